"""How a four-bar is drawn: the ground's pivots on the x axis, that of the crank at the origin."""

from explore.model.drawing import INPUT, Drawing, Link, Path, Vector

_CRANK, _GROUND, _ROCKER = Vector("crank", INPUT), Vector("ground"), Vector("rocker", "rocker_angle")

DRAWING = Drawing(
    points={
        "crank pivot": (),
        "crank joint": (_CRANK,),
        "rocker joint": (_GROUND, _ROCKER),
        "rocker pivot": (_GROUND,),
    },
    links=(
        Link("crank", ("crank pivot", "crank joint")),
        Link("coupler", ("crank joint", "rocker joint")),
        Link("rocker", ("rocker joint", "rocker pivot")),
    ),
    pivots=("crank pivot", "rocker pivot"),
    paths=(
        Path("crank joint", "path of the joint of crank and coupler"),
        Path("rocker joint", "path of the joint of coupler and rocker", "output"),
    ),
    stroke_point="crank joint",
)
