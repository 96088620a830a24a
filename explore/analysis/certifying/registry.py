"""The mechanisms whose designs can be certified, each with the module of its certificates."""

from importlib import import_module

from explore.analysis.certifying.contract import MakeCertificate
from explore.base.errors import RequestError
from explore.mechanisms.linkages.table import PREFIX

_MODULES = {"crank-rocker": "crank_rocker", "slider-crank": "slider_crank"}


def find_certificate(mechanism: str) -> MakeCertificate:
    """The maker of certificates of a mechanism; `RequestError` if it has none."""
    is_table = mechanism.startswith(PREFIX)
    if not is_table and mechanism not in _MODULES:
        raise RequestError(
            f"designs of {mechanism} cannot be certified: there is no proof of its numbers yet; "
            f"available: {', '.join(_MODULES)} and tables"
        )
    module = "linkage" if is_table else _MODULES[mechanism]
    make: MakeCertificate = import_module(f"explore.analysis.certifying.{module}").certify
    return make
