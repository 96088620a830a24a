"""The charts of results under their public name; see `explore.figures.charts`."""

from explore.figures.charts import __all__ as __all__
from explore.figures.charts import __dir__ as __dir__
from explore.figures.charts import __getattr__ as __getattr__
