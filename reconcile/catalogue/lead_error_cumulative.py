"""Cumulative lead error: scale less motor grows with the position, alike in both directions."""

from hil_sim.physics.transmission import lead_error_cumulative as physics
from reconcile.catalogue.entry import CatalogueEntry, IndicatorKind, PlausibleTerm, Rival
from reconcile.catalogue.kinds import ResidualChannel, TermFamily

ENTRY = CatalogueEntry(
    physics=physics,
    terms=(
        TermFamily(
            lambda data, _shape: data.motion.position_m[:, None].copy(),
            channel=ResidualChannel.POSITION_DEVIATION,
        ),
    ),
    coefficients={"relative_error": ""},
    sentence=lambda p: (
        f"the scale gains {p['relative_error'] * 1e6:.1f} um per metre on the motor, alike in both "
        "directions and from the first minute: a lead error; thermal expansion would drift"
    ),
    indicators=(IndicatorKind(name="lead_error", unit="", words="lead error", beside=True),),
    rivals=(Rival("thermal_expansion", "a lead error is there from the start", experiment="warm"),),
    shown_by="it is there from the start",
    plausible=lambda _sizes: [PlausibleTerm((), (2e-5,))],
    rank=19,
)
