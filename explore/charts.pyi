from .figures.charts import *  # noqa: F403  (the names are those of the package)
