"""The mechanisms whose designs can be certified, each with the module of its certificates."""

from importlib import import_module

from explore.analysis.certifying.contract import MakeCertificate
from explore.base.errors import RequestError

_MODULES = {"crank-rocker": "crank_rocker", "slider-crank": "slider_crank"}


def find_certificate(mechanism: str) -> MakeCertificate:
    """The maker of certificates of a mechanism; `RequestError` if it has none."""
    if mechanism not in _MODULES:
        raise RequestError(
            f"designs of {mechanism} cannot be certified: there is no proof of its numbers yet; "
            f"available: {', '.join(_MODULES)}"
        )
    make: MakeCertificate = import_module(f"explore.analysis.certifying.{_MODULES[mechanism]}").certify
    return make
