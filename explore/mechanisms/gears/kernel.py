"""The gear pair, compiled. Its laws are in `law`, its pitch curves in `geometry`, trains of pairs in `drive`."""

import math

from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE, LANES, compiled
from explore.base.lanes.arctangent import arctangent
from explore.base.subroutines import subroutine
from explore.mechanisms.gears import columns
from explore.mechanisms.gears.columns import Row
from explore.mechanisms.gears.drive import (
    joints_at,
    overall_ratio_at,
    solve_ripple,
    solve_second_joints,
    solve_shift,
    train_ratio_at,
)
from explore.mechanisms.gears.geometry import (
    extremes_of_ratio,
    fill_pitch_curves,
    fill_pitch_lengths,
    jump_of_curvature,
    least_convexities,
)
from explore.mechanisms.gears.law import working_driven_angle, working_ratio
from explore.mechanisms.gears.sine_law import sine_driven_angle, sine_ratio, solve_sine_law
from explore.mechanisms.gears.smoothstep_law import smoothstep_driven_angle, smoothstep_ratio, solve_smoothstep_law
from explore.model.status import OwnStatus, Status

#: Largest ln m^b: the ratio grows by a factor of 1e100, and products of ratios stay finite.
_LARGEST_LOGARITHM = 100.0 * math.log(10.0)

_DEGREES = 180.0 / math.pi
_OK, _FIRST_PARAMETER = int(Status.OK), int(Row.GROWTH)
_FIRST_METRIC, _LAST_METRIC = int(Row.LAW_CONSTANT), int(Row.RIPPLE)

NO_GROWTH, NO_RETURN, BROKEN_BRANCH, OVERFLOW, NO_BRANCH = 20, 21, 22, 23, 24
STATUSES = {
    NO_GROWTH: OwnStatus("no_growth", "the growth per radian is not above 1"),
    NO_RETURN: OwnStatus("no_return", "the working sector takes a full turn, 2 pi rad, or more: no return is left"),
    BROKEN_BRANCH: OwnStatus("broken_branch", "the branch is not a whole number"),
    OVERFLOW: OwnStatus("ratio_overflow", "the ratio would change by more than a factor of 1e100 over the sector"),
    NO_BRANCH: OwnStatus("no_branch", "the log-smoothstep law of the return has no branch but 1"),
}


@subroutine()
def _status_of(growth, sector, order, branch):
    """The status of a design."""
    if growth <= 1.0:
        return NO_GROWTH
    if sector >= 2.0 * math.pi:
        return NO_RETURN
    if branch != math.floor(branch):
        return BROKEN_BRANCH
    if math.log(growth) * sector > _LARGEST_LOGARITHM:
        return OVERFLOW
    if order > 0.0 and branch != 1.0:
        return NO_BRANCH
    return _OK


@subroutine()
def _fill_constants(record, lane):
    """Fill the constants and their metrics of one lane."""
    growth, sector = record[Row.GROWTH * LANES + lane], record[Row.SECTOR * LANES + lane]
    order = record[Row.RETURN_ORDER * LANES + lane]
    record[columns.LOG_GROWTH * LANES + lane], record[columns.SECTOR_ANGLE * LANES + lane] = math.log(growth), sector
    record[columns.ORDER * LANES + lane] = order
    record[columns.DISTANCE * LANES + lane] = record[Row.CENTRE_DISTANCE * LANES + lane]
    record[columns.N_TRAINS * LANES + lane] = record[Row.TRAINS * LANES + lane]
    record[columns.SHIFT * LANES + lane] = record[Row.PHASE_SHIFT * LANES + lane]
    record[columns.START_JOINT * LANES + lane] = 0.0
    record[columns.END_JOINT * LANES + lane] = math.tan(0.5 * sector)
    if order > 0.0:
        solve_smoothstep_law(record, lane)
        return
    record[Row.RETURN_SHIFT * LANES + lane] = solve_sine_law(record[Row.BRANCH * LANES + lane], record, lane)
    amplitude = record[columns.AMPLITUDE * LANES + lane]
    record[Row.RETURN_AMPLITUDE * LANES + lane] = amplitude
    record[Row.RETURN_FREQUENCY * LANES + lane] = record[columns.FREQUENCY * LANES + lane]
    record[Row.RETURN_MEAN * LANES + lane] = record[columns.LOWEST * LANES + lane] + amplitude


@subroutine()
def _fill_metrics(record, lane):
    """Fill the metrics of one lane from its constants."""
    log_growth, constant = record[columns.LOG_GROWTH * LANES + lane], record[columns.CONSTANT * LANES + lane]
    sector, start = record[columns.SECTOR_ANGLE * LANES + lane], record[columns.START * LANES + lane]
    record[Row.LAW_CONSTANT * LANES + lane] = constant
    record[Row.RATIO_START * LANES + lane] = start
    record[Row.RATIO_END * LANES + lane] = start * math.exp(-log_growth * sector)
    lowest, highest = extremes_of_ratio(record, lane)
    record[Row.RATIO_MIN * LANES + lane], record[Row.RATIO_MAX * LANES + lane] = lowest, highest
    record[Row.DRIVEN_SECTOR * LANES + lane] = record[columns.DRIVEN_SECTOR * LANES + lane] * _DEGREES
    driver, driven, tilt = least_convexities(record, lane)
    record[Row.CONVEXITY_DRIVER * LANES + lane], record[Row.CONVEXITY_DRIVEN * LANES + lane] = driver, driven
    record[Row.TANGENT_TILT_MAX * LANES + lane] = tilt * _DEGREES
    record[Row.CURVATURE_JUMP * LANES + lane] = jump_of_curvature(record, lane)
    shift, ratio = solve_shift(log_growth, sector, constant, record[columns.N_TRAINS * LANES + lane])
    record[Row.PHASE_SHIFT_MAX * LANES + lane], record[Row.DRIVE_RATIO_MAX * LANES + lane] = shift, ratio
    record[Row.RIPPLE * LANES + lane] = solve_ripple(record, lane, record[Row.BRANCH * LANES + lane], shift)


@subroutine()
def _is_repeated(record, lane):
    """Whether the design of a lane is that of the lane before, as in the last tile."""
    for row in range(_FIRST_PARAMETER, _FIRST_METRIC):
        if record[row * LANES + lane] != record[row * LANES + lane - 1]:
            return False
    return True


@compiled(CLOSE_SIGNATURE)
def close(record):
    """Fill constants, status and metrics; see `explore.model.mechanism.Mechanism`. Metrics are NaN where undefined."""
    for lane in range(LANES):
        if lane > 0 and _is_repeated(record, lane):
            for row in range(_LAST_METRIC + 1):
                record[row * LANES + lane] = record[row * LANES + lane - 1]
            continue
        status = _status_of(
            record[Row.GROWTH * LANES + lane], record[Row.SECTOR * LANES + lane],
            record[Row.RETURN_ORDER * LANES + lane], record[Row.BRANCH * LANES + lane],
        )  # fmt: skip
        record[Row.STATUS * LANES + lane] = float(status)
        # a law fills the constants that it needs
        for constant in range(columns.GEARS_SIZE):
            record[constant * LANES + lane] = 0.0
        for metric in range(_FIRST_METRIC, _LAST_METRIC + 1):
            record[metric * LANES + lane] = math.nan
        if status == _OK:
            _fill_constants(record, lane)
            solve_second_joints(record, lane)
            _fill_metrics(record, lane)


@subroutine(inlined=True)
def _working_angle(constants, tangents, lane, anchor):
    """The angle of a node in the working sector, rad: what is before the middle of the return is before the start."""
    angle = 2.0 * arctangent(tangents[lane], 1.0) + (math.pi if anchor == 1 else 0.0)
    first = 0.5 * constants[columns.SECTOR_ANGLE * LANES + lane] - math.pi
    return angle + 2.0 * math.pi if angle < first else angle


@subroutine(inlined=True)
def _angle_beyond(constants, tangents, lane, anchor):
    """The angle of a node beyond the end of the working sector, rad, exactly 0 there: ratios may be steep."""
    u, end = tangents[lane], constants[columns.END_JOINT * LANES + lane]
    along, across = (end - u, 1.0 + u * end) if anchor == 1 else (1.0 + u * end, u - end)
    half, first = arctangent(across, along), -0.25 * constants[columns.SECTOR_ANGLE * LANES + lane]
    half = half + math.pi if half < first else half
    return 2.0 * (half - math.pi if half >= first + math.pi else half)


@subroutine(inlined=True)
def _put_ratio(out, lane, ratio, rate, acceleration):
    out[columns.RATIO * LANES + lane], out[columns.RATIO_RATE * LANES + lane] = ratio, rate
    out[columns.RATIO_ACCELERATION * LANES + lane] = acceleration


@subroutine(no_alias=True)
def _fill_working_ratios(constants, tangents, anchor, out):
    """Fill the ratio in the working sector."""
    for lane in range(LANES):
        angle = _working_angle(constants, tangents, lane, anchor)
        ratio, rate, acceleration = working_ratio(constants, lane, angle)
        _put_ratio(out, lane, ratio, rate, acceleration)


@subroutine(no_alias=True)
def _fill_working_angles(constants, tangents, anchor, out):
    """Fill the driven angle in the working sector."""
    for lane in range(LANES):
        angle = _working_angle(constants, tangents, lane, anchor)
        out[columns.DRIVEN_ANGLE * LANES + lane] = working_driven_angle(constants, lane, angle)


@subroutine(no_alias=True)
def _fill_return_ratios(constants, tangents, anchor, out):
    """Fill the ratio in the return sector by the sine law."""
    for lane in range(LANES):
        beyond = _angle_beyond(constants, tangents, lane, anchor)
        ratio, rate, acceleration = sine_ratio(constants, lane, beyond)
        _put_ratio(out, lane, ratio, rate, acceleration)


@subroutine(no_alias=True)
def _fill_return_angles(constants, tangents, anchor, out):
    """Fill the driven angle in the return sector by the sine law."""
    for lane in range(LANES):
        beyond = _angle_beyond(constants, tangents, lane, anchor)
        out[columns.DRIVEN_ANGLE * LANES + lane] = sine_driven_angle(constants, lane, beyond)


@subroutine(no_alias=True)
def _fill_smoothstep_ratios(constants, tangents, anchor, out):
    """Replace the ratio in the return sector of lanes with a smoothstep law."""
    for lane in range(LANES):
        is_smooth = constants[columns.ORDER * LANES + lane] > 0.0
        ratio, rate = out[columns.RATIO * LANES + lane], out[columns.RATIO_RATE * LANES + lane]
        acceleration = out[columns.RATIO_ACCELERATION * LANES + lane]
        own = smoothstep_ratio(constants, lane, _angle_beyond(constants, tangents, lane, anchor))
        ratio, rate = own[0] if is_smooth else ratio, own[1] if is_smooth else rate
        _put_ratio(out, lane, ratio, rate, own[2] if is_smooth else acceleration)


@subroutine()
def _fill_smoothstep_angles(constants, tangents, anchor, out):
    """Replace the driven angle in the return sector of lanes with a smoothstep law."""
    for lane in range(LANES):
        if constants[columns.ORDER * LANES + lane] > 0.0:
            beyond = _angle_beyond(constants, tangents, lane, anchor)
            out[columns.DRIVEN_ANGLE * LANES + lane] = smoothstep_driven_angle(constants, lane, beyond)


@subroutine()
def _fill_return(constants, tangents, anchor, smooth_lanes, needs_angle, out):
    """Fill ratio and driven angle in the return sector, where so many lanes have a smoothstep law."""
    if smooth_lanes < LANES:
        _fill_return_ratios(constants, tangents, anchor, out)
        if needs_angle:
            _fill_return_angles(constants, tangents, anchor, out)
    if smooth_lanes > 0:
        _fill_smoothstep_ratios(constants, tangents, anchor, out)
        if needs_angle:
            _fill_smoothstep_angles(constants, tangents, anchor, out)


@subroutine(no_alias=True)
def _fill_speed_ratios(out):
    speed_ratios = out[columns.SPEED_RATIO * LANES : (columns.SPEED_RATIO + 1) * LANES]
    for lane in range(len(speed_ratios)):  # as in `geometry.fill_pitch_lengths`
        ratio, rate = out[columns.RATIO * LANES + lane], out[columns.RATIO_RATE * LANES + lane]
        speed_ratios[lane] = 1.0 / ratio
        out[columns.SPEED_RATIO_RATE * LANES + lane] = -rate / (ratio * ratio)


@subroutine(no_alias=True)
def _fill_joints(constants, out):
    """Fill the numbers that change their signs at joints."""
    for lane in range(LANES):
        train, first, second = joints_at(constants, lane, out[columns.DRIVEN_ANGLE * LANES + lane])
        out[columns.TRAIN_JOINTS * LANES + lane] = train
        out[columns.FIRST_JOINTS * LANES + lane], out[columns.SECOND_JOINTS * LANES + lane] = first, second


@subroutine()
def _fill_trains(constants, tangents, anchor, is_return, needs, out):
    """Fill the ratios of one train and of all."""
    for lane in range(LANES):
        angle = _working_angle(constants, tangents, lane, anchor)
        if is_return:
            angle = constants[columns.SECTOR_ANGLE * LANES + lane] + _angle_beyond(constants, tangents, lane, anchor)
        if needs & columns.TRAIN:
            out[columns.TRAIN_RATIO * LANES + lane] = train_ratio_at(constants, lane, angle)
        if needs & columns.DRIVE:
            driven_angle = out[columns.DRIVEN_ANGLE * LANES + lane]
            out[columns.OVERALL_RATIO * LANES + lane] = overall_ratio_at(constants, lane, angle, driven_angle)


@compiled(FILL_SIGNATURE)
def fill(constants, tangents, anchor, law, _variant, count, needs, out):
    """Fill the signals, in rad and mm; law 0 is the working sector, 1 the return; see `Mechanism.fill`."""
    needs_angle, smooth_lanes = needs & (columns.ANGLES | columns.DRIVE | columns.JOINTS) != 0, 0
    for lane in range(LANES):
        smooth_lanes += 1 if constants[columns.ORDER * LANES + lane] > 0.0 else 0
    for j in range(count):
        node, signals = tangents[j * LANES :], out[j * columns.SIGNAL_ROWS * LANES :]
        if law == 1:
            _fill_return(constants, node, anchor, smooth_lanes, needs_angle, signals)
        else:
            _fill_working_ratios(constants, node, anchor, signals)
            if needs_angle:
                _fill_working_angles(constants, node, anchor, signals)
        if needs & columns.RATIOS:
            _fill_speed_ratios(signals)
        if needs & columns.PITCH_LENGTHS:
            fill_pitch_lengths(constants, signals)
        if needs & columns.PITCH_CURVES:
            fill_pitch_curves(constants, signals)
        if needs & columns.JOINTS:
            _fill_joints(constants, signals)
        if needs & (columns.TRAIN | columns.DRIVE):
            _fill_trains(constants, node, anchor, law == 1, needs, signals)
