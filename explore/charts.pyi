# The public names: read by type checkers, and at run time by lazy_loader.
from .figures.charts.burmester import burmester_chart as burmester_chart
from .figures.charts.cognates import cognates_chart as cognates_chart
from .figures.charts.coverage import coverage_chart as coverage_chart
from .figures.charts.dwell import dwell_chart as dwell_chart
from .figures.charts.joint_pareto import joint_pareto_chart as joint_pareto_chart
from .figures.charts.map import map_chart as map_chart
from .figures.charts.mechanism import mechanism_chart as mechanism_chart
from .figures.charts.motion import motion_chart as motion_chart
from .figures.charts.parallel import parallel_chart as parallel_chart
from .figures.charts.pareto import pareto_chart as pareto_chart
from .figures.charts.path import path_chart as path_chart
from .figures.charts.ratio import ratio_chart as ratio_chart
from .figures.charts.sensitivity import sensitivity_chart as sensitivity_chart
from .figures.charts.tolerances import tolerance_chart as tolerance_chart
from .figures.charts.tuning import tuning_chart as tuning_chart
