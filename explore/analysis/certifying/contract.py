"""What a mechanism brings so that its designs can be certified."""

from collections.abc import Callable, Mapping
from typing import Protocol

from explore.analysis.certifying.balls import Enclosure
from explore.model.quantities import DerivedMetric, Metric, SampledMetric
from explore.model.request import Request


class Certificate(Protocol):
    """Enclosures of the metrics of one design, at the precision that is set when it is made and used."""

    @property
    def status(self) -> int:
        """The status of the design by exact signs, before constraints and tolerances."""

    def enclose(self, metric: Metric | SampledMetric | DerivedMetric) -> Enclosure | None:
        """Enclose a metric in its unit; None where the design has none, NaN in results.

        Derived metrics are those that the mechanism declares; formulas of a study are computed from their inputs.
        Raises `UnprovedError` if it cannot be certified: no enclosure is implemented; and `UndecidedError` if the
        precision is too low.
        """


#: Function that makes the certificate of a design from its given parameters and the request.
MakeCertificate = Callable[[Mapping[str, float], Request], Certificate]
