"""The study of a linkage that another program wrote, by what its text looks like."""

from collections.abc import Callable

from explore.base.errors import RequestError
from explore.base.suggest import one_line
from explore.studies.config.toml_text import read_text
from explore.studies.imports.drawn import Drawn, study_of
from explore.studies.imports.pmks_address import read_pmks
from explore.studies.imports.pylinkage_file import read_pylinkage
from explore.studies.imports.pyslvs_expression import read_pyslvs

_HEAD = """# {source}
#
#     explore sweep THIS_FILE
#
# All parameters are lengths of the position that was drawn, in mm where it has no unit; give ranges to sweep them, such
# as {{ min = 30, max = 40 }}. `explore mechanisms THIS_FILE` lists all signals and metrics of this table.
"""


def imported_study(source: str) -> tuple[str, list[str]]:
    """The text of a study of a linkage of another program, and sentences on what is read in another way.

    The source is a file, or the text itself: an address of PMKS+ or an expression of Pyslvs. A `RequestError` has one
    line, if it is none of them or no table can describe it.
    """
    is_text = source.lstrip().startswith(("M[", "http://", "https://", "?"))
    text = source if is_text else read_text(source, "it is too large for a linkage").strip()
    name, read = _reader(text)
    try:
        drawn = read(text)
        study = study_of(drawn)
    except RequestError as error:
        raise RequestError(one_line(f"{name if is_text else source}: {error}")) from None
    title = f"A linkage of {name}{'' if is_text else f', read from {source.rpartition(chr(47))[2]!r}'}."
    remarks = "".join(f"# {remark}\n" for remark in drawn.remarks)
    return _HEAD.format(source=title) + (f"#\n{remarks}" if remarks else "") + f"\n{study}", drawn.remarks


def _reader(text: str) -> tuple[str, Callable[[str], Drawn]]:
    """The program whose text it is, and how it is read."""
    if text.startswith("{"):
        return "pylinkage", read_pylinkage
    if text.startswith(("M[", "#")):
        return "Pyslvs", read_pyslvs
    return "PMKS+", read_pmks
