# The public names: read by type checkers, and at run time by lazy_loader.
from .burmester import burmester_chart as burmester_chart
from .cognates import cognates_chart as cognates_chart
from .coverage import coverage_chart as coverage_chart
from .dwell import dwell_chart as dwell_chart
from .joint_pareto import joint_pareto_chart as joint_pareto_chart
from .map import map_chart as map_chart
from .mechanism import mechanism_chart as mechanism_chart
from .motion import motion_chart as motion_chart
from .parallel import parallel_chart as parallel_chart
from .pareto import pareto_chart as pareto_chart
from .path import path_chart as path_chart
from .ratio import ratio_chart as ratio_chart
from .sensitivity import sensitivity_chart as sensitivity_chart
from .tolerances import tolerance_chart as tolerance_chart
from .tuning import tuning_chart as tuning_chart
