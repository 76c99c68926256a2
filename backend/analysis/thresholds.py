"""Thresholds of the analysis: every number that was chosen and not derived, in one table.

One namespace for each module, which imports it as ``threshold``. Behind each number stands its
unit in brackets ("ratio" and "count" have none), what it decides, and its origin: the commit that
set it, with the benchmark or page of figures that the commit changed, where it changed one.
"Halved" and "doubled" say what `python -m benchmarks.thresholds` measured with the number changed
on the axes of `tests/unit/analysis/random_axes.py`; a number without them was not measured.
Numbers that follow from a definition (95 % of a normal distribution, counts of model parameters,
coefficients of a drive's format) stand in their modules.
"""

from __future__ import annotations


class load_side:
    """`mechanics/load_side.py` and `mechanics/load_side_samples.py`."""

    # WINDOW_S, THINNED_HZ: Length of the low-pass window that all signals pass, and how many
    # samples a second are kept after it.
    WINDOW_S = 0.03
    """[s] Origin: 28457f47."""
    THINNED_HZ = 250.0
    """[Hz] Origin: 28457f47."""
    # FEWEST, GROUPS: Samples of slow passes, and groups of moves, below which nothing is said.
    FEWEST = 100
    """[count] Origin: 28457f47."""
    GROUPS = 4
    """[count] Origin: 28457f47."""
    MOVED = 16.0
    """[count] A load that turned by less over the slow passes does not follow. Origin: 28457f47."""
    COUNTS = 0.5
    """[count] Nothing is known better than this share of a count of the load. Origin: 28457f47."""
    # COVERED, ORDERS, APART: This share of a revolution counts as one; errors of so many orders per
    # revolution are looked for, those of the motor where they are so far from those of the load.
    COVERED = 0.98
    """[ratio] Origin: 28457f47."""
    ORDERS = 6
    """[count] Origin: 28457f47."""
    APART = 0.05
    """[ratio] Origin: 28457f47."""
    # QUIETEST, RESTLESS: A load that moves against the motor by so many times what it does in the
    # quietest share of the samples crosses the gap, or bounces.
    QUIETEST = 0.2
    """[ratio] Origin: 28457f47."""
    RESTLESS = 2.0
    """[ratio] Origin: 28457f47."""
    POWERS = 8
    """[count] Polynomials that stand for the error over a part of a revolution. Origin:
    28457f47."""
    # LARGE, NEAR: Quantile of the accelerations that counts as the largest; a force on the load of
    # a smaller share of it does not say on which flank it lies.
    LARGE = 0.9
    """[ratio] Origin: 28457f47."""
    NEAR = 0.08
    """[ratio] Origin: 28457f47."""
    COARSE = 4
    """[count] One of so many samples is enough for that search. Origin: 28457f47."""
    # FRICTION, STEPS: Friction of the load is searched for up to this share of the largest force,
    # in so many steps.
    FRICTION = 1.6
    """[ratio] Origin: 28457f47."""
    STEPS = 33
    """[count] Origin: 28457f47."""
    # NO_PULL, PULLS: A smaller pull than this share counts for nothing; a larger one may act on so
    # many times less inertia than the motor turns.
    NO_PULL = 0.04
    """[ratio] Origin: 28457f47."""
    PULLS = (1.0, 1.25, 1.6, 2.0, 3.0, 5.0)
    """[ratio] Origin: 28457f47."""
    PULLED = 0.2
    """[ratio] A pull of more than this share of the largest acceleration leaves no certain flanks.
    Origin: 28457f47."""
    SEEN = 2.0
    """[ratio] A twist counts as seen from so many times its uncertainty on. Origin: 28457f47."""
    SHARE = 0.03
    """[ratio] Nothing is known better than this share of it, whatever the scatter. Origin:
    28457f47."""
    SHARE_OF_INERTIA = 0.05
    """[ratio] Nor the inertia of the load better than this: drawn axes were off by up to 3.5 %, one
    run through a virtual drive by 5 %. Origin: 28457f47."""
    # SMALL, ENDLESS, SAME: Friction that twists by a smaller share of the gap moves no flank, one
    # above so many times the largest force always decides; flanks agree where this share does.
    SMALL = 0.03
    """[ratio] Origin: 28457f47."""
    ENDLESS = 100.0
    """[ratio] Origin: 28457f47."""
    SAME = 0.98
    """[ratio] Origin: 28457f47."""
    SEPARABLE = 0.02
    """[ratio] Share of the flanks' variance that direction and acceleration must leave. Origin:
    28457f47."""
    CONDITION = 1e10
    """[ratio] Of normal equations that are solved and refined once. Origin: IEEE 754 double."""
    # TRIMMED, OUTSIDE, MOST_OUTSIDE: So often samples are left out that lie so many deviations off,
    # as they bounce or cross the gap, unless they are more than this share.
    TRIMMED = 2
    """[count] Origin: 28457f47."""
    OUTSIDE = 5.0
    """[ratio] Origin: 28457f47."""
    MOST_OUTSIDE = 0.2
    """[ratio] Origin: 28457f47."""
    BINS = 180
    """[count] Places at which the error is drawn. Origin: 28457f47."""


class loop_goals:
    """`loop/loop_goals.py`."""

    RESERVE = (1.5, 3.0, 1.03)
    """[ratio] A measured margin may be off by this: dB, degrees, factor of Ms. Origin: 66bd184e
    with benchmarks/tune_accuracy."""


class loop_search:
    """`loop/loop_search.py`."""

    INTEGRAL_RATIO = 10.0
    """[ratio] The PI's corner is the speed bandwidth divided by this. Origin: 66bd184e with
    benchmarks/tune_accuracy."""
    PRICE = 0.03
    """[ratio] A notch, or a wider filter, must earn its place: this share of the bandwidth each.
    Origin: 66bd184e with benchmarks/tune_accuracy."""
    LOWEST_HZ = 0.5
    """[Hz] Speed bandwidth from which a search of the gain begins. Origin: 66bd184e with
    benchmarks/tune_accuracy."""
    RESOLUTION = 0.01
    """[ratio] A gain is found to this share; what is better by less is not better. Origin: 66bd184e
    with benchmarks/tune_accuracy."""
    COARSE = 1.4
    """[ratio] Gains are looked at in these steps before that. Origin: 691daa5e with
    docs/tuning-accuracy.md."""
    WIDTHS = (0.25, 0.5, 0.9, 1.5, 2.2)
    """[ratio] Widths as multiples of the centre that are tried at every place. Origin: 66bd184e
    with benchmarks/tune_accuracy."""
    DEPTHS = (-2.0, -6.0, -10.0, -16.0, -24.0)
    """[dB] Depths that are tried at every place. Origin: 38c6d47b with docs/tuning-accuracy.md."""
    PLACES = (0.8, 1.0, 1.25, 1.6)
    """[ratio] Places as multiples of a resonance: a wide notch above it takes the gain down from
    the resonance on, where the motor turns alone, and costs less phase below than one upon it.
    Origin: 66bd184e with benchmarks/tune_accuracy."""
    STEP = (0.12, 0.4, 5.0)
    """[ratio] First steps of the pattern search: share of centre, share of width, dB. Origin:
    66bd184e with benchmarks/tune_accuracy."""
    # HALVINGS, SWEEPS: So often the steps of the pattern search are halved; rounds over all notches
    # at each size.
    HALVINGS = 4
    """[count] Origin: 66bd184e with benchmarks/tune_accuracy."""
    SWEEPS = 4
    """[count] Origin: 66bd184e with benchmarks/tune_accuracy."""
    BEGUN = 0.9
    """[ratio] A seed may be worth this share of what it is added to. Origin: 38c6d47b with
    docs/tuning-accuracy.md."""
    # TRIED, TRIED_AT_LAST: Random steps of all notches: how many for each number of them, and for
    # the winner.
    TRIED = 60
    """[count] Origin: 38c6d47b with docs/tuning-accuracy.md."""
    TRIED_AT_LAST = 400
    """[count] Origin: 38c6d47b with docs/tuning-accuracy.md."""
    # SPREAD, AT_ONCE, WIDER, NARROWER, FINEST: Random steps: their spread (share of centre, share
    # of width, dB), the share of coordinates that change at once, the factor after a better step
    # and after a worse one, and the smallest spread.
    SPREAD = (0.12, 0.4, 3.0)
    """[ratio] Origin: 38c6d47b with docs/tuning-accuracy.md."""
    AT_ONCE = 0.5
    """[ratio] Origin: 38c6d47b with docs/tuning-accuracy.md."""
    WIDER = 1.5
    """[ratio] Origin: 38c6d47b with docs/tuning-accuracy.md."""
    NARROWER = 0.93
    """[ratio] Origin: 38c6d47b with docs/tuning-accuracy.md."""
    FINEST = 0.05
    """[ratio] Origin: 38c6d47b with docs/tuning-accuracy.md."""
    # DEEPEST_DB, WIDEST, NARROWEST: Bounds of a notch: depth, and width as a multiple of its
    # centre.
    DEEPEST_DB = -40.0
    """[dB] Origin: 66bd184e with benchmarks/tune_accuracy."""
    WIDEST = 4.0
    """[ratio] Origin: 66bd184e with benchmarks/tune_accuracy."""
    NARROWEST = 0.08
    """[ratio] Origin: 66bd184e with benchmarks/tune_accuracy."""
    LOWEST_PLACE_HZ = 15.0
    """[Hz] Lowest centre of a notch. Origin: 691daa5e with docs/tuning-accuracy.md."""
    FARTHEST = 2.5
    """[ratio] Highest centre of a notch, as a multiple of the highest measured line. Origin:
    66bd184e with benchmarks/tune_accuracy."""
    SOME = 4
    """[count] Every such line is looked at first; most shapes are refused by these alone. Origin:
    38c6d47b with docs/tuning-accuracy.md."""


class loop_seen:
    """`loop/loop_seen.py`."""

    OFF = 0.025
    """[ratio] What a line of a closed loop may be off by, whatever its scatter says (logarithm):
    half of the 0.4 dB and 3° that such a measurement is held to. Origin: 52bbdd17 with
    benchmarks/autotune_accuracy."""
    OCTAVES = 1.0 / 6.0
    """[octaves] Half width of the window that lines are averaged over, in octaves: the distortion
    of play scatters from line to line, what it does to the plant does not. Origin: 52bbdd17 with
    benchmarks/autotune_accuracy."""
    DENSE = 0.75
    """[ratio] This share of the lines of such a window must be sharp. Origin: 52bbdd17 with
    benchmarks/autotune_accuracy."""
    LINES = 12
    """[count] A plant is read from so many lines at least. Origin: 52bbdd17 with
    benchmarks/autotune_accuracy."""
    FADE = 1.26
    """[ratio] The correction ends this factor beyond the lines. Origin: 52bbdd17 with
    benchmarks/autotune_accuracy."""


class loop_verdict:
    """`loop/loop_verdict.py`."""

    MOST_DB = 60.0
    """[dB] Gains that no crossing of the negative real axis limits are stated up to this. Origin:
    17b160fe."""
    # SIZE, LATE_S: A prediction is not known better than this where it is not measured: logarithm
    # of its size, and seconds of delay (half of the shortest loop period in use, 62.5 µs).
    SIZE = 0.05
    """[log] Origin: 17b160fe."""
    LATE_S = 30e-6
    """[s] Origin: 17b160fe."""
    PER_OCTAVE = 0.3
    """[log] Beyond the measured band a stated gain margin is known the worse the further away:
    logarithm of a size for each octave above the last line. Sampling, filters and the current loop
    are assumed there: of a drive with another loop period (62.5 to 250 µs) it was 5 dB off two
    octaves above. Origin: 2e0d8856."""
    # UNSEEN, UNSEEN_S: Where no line shows it: loop periods of 62.5 to 250 µs, where 50 µs are
    # assumed, and 1.5 dB.
    UNSEEN = 0.17
    """[log] Origin: 17b160fe."""
    UNSEEN_S = 200e-6
    """[s] Origin: 17b160fe."""
    FEW = 6
    """[count] Fewer lines say nothing of margins. Origin: 17b160fe."""
    # WORST_DEG, WORST_DB: The worst end of an interval is no more than this below a guaranteed
    # value: degrees, dB, and that many dB as a factor of the sensitivity.
    WORST_DEG = 5.0
    """[deg] Origin: 886716e8."""
    WORST_DB = 1.0
    """[dB] Origin: 886716e8."""
    # SIZES, DELAYS, APART_DEG: So many sizes and delays are looked at between the ends of their
    # intervals; of delays as many, within these limits, as turn the last crossover by no more.
    SIZES = 3
    """[count] Origin: d16e3511."""
    DELAYS = (5, 41)
    """[count] Origin: d16e3511, benchmarks/rough_campaign."""
    APART_DEG = 3.0
    """[deg] Below WORST_DEG. Origin: benchmarks/rough_campaign."""
    LEFT_STEPS = 21
    """[count] Sizes, and as many delays, over which the mean of what a raised gain leaves is
    formed. Origin: benchmarks/rough_campaign."""


class mode_above:
    """`loop/mode_above.py`."""

    LEADS_DEG = 30.0
    """[deg] A speed that leads the torque by more is that of a spring; below a resonance it is 90
    degrees. Origin: benchmarks/rough_campaign, axis 332."""
    LINES = 8
    """[count] Fewer lines that lead show no spring. Origin: benchmarks/rough_campaign, axis 332."""
    OFF = 0.02
    """[ratio] What a line may be off by. Origin: as reference_path.OFF."""
    # NEAREST, FARTHEST, PLACES: Frequencies that are tried, over that of the highest line.
    NEAREST = 1.02
    """[ratio] Origin: benchmarks/rough_campaign, axis 332."""
    FARTHEST = 4.0
    """[ratio] Origin: benchmarks/rough_campaign, axis 332."""
    PLACES = 60
    """[count] Origin: benchmarks/rough_campaign, axis 332."""
    ALIKE = 0.25
    """[ratio] Modes whose mean square misfit, in units of OFF, is larger by less than this are all
    possible: lines that are off by half of it in the same way. Origin: test_mode_above.py."""
    DAMPINGS = (0.01, 0.03, 0.08)
    """[ratio] Dampings that are tried for it. Origin: couplings of benchmarks/tune_accuracy."""


class measured_plant:
    """`loop/measured_plant.py`."""

    FREQUENCY_FACTORS = (0.95, 1.0, 1.05)
    """[ratio] Modes may move by this factor in frequency and this in damping after the measurement.
    Origin: 64a6c047."""
    DAMPING_FACTORS = (0.6, 1.0, 1.4)
    """[ratio] Modes may change by this factor in damping after the measurement. Origin:
    64a6c047."""
    BEYOND = 1.25
    """[ratio] A mode is known a little way beyond the highest line. The factor of frequency counts
    twice up to here, and four times above, where a mode stands for whatever is stiffer than what
    was measured. Origin: 66bd184e with benchmarks/tune_accuracy."""
    LET_GO = 1.26
    """[ratio] The motor is alone from so far above the highest line on. Origin: 6d4863d4."""


class notch_effect:
    """`loop/notch_effect.py`."""

    IMAGES = 25
    """[count] Images that are counted on each side, multiples of the sample rate. Origin: 7166e5a3
    with benchmarks/tune_accuracy."""
    DEEPEST_DB = -45.0
    """[dB] A depth that cannot be distinguished from a deeper one. Origin: 7166e5a3 with
    benchmarks/tune_accuracy."""
    NO_EFFECT = 0.93
    """[ratio] A ratio that nowhere falls below this shows no notch. Origin: e15b4fe3 with
    docs/tuning-accuracy.md."""
    # KNOWN_TO, LEAST_LINES, EXPLAINED: Lines with a closed loop whose ratio is known to this (one
    # deviation) are used; at least so many of them within an octave of the centre, and the notch
    # must explain their median to this.
    KNOWN_TO = 0.1
    """[ratio] Origin: e15b4fe3 with docs/tuning-accuracy.md."""
    LEAST_LINES = 12
    """[count] Origin: e15b4fe3 with docs/tuning-accuracy.md."""
    EXPLAINED = 0.06
    """[ratio] Origin: e15b4fe3 with docs/tuning-accuracy.md."""
    ALIKE_LINES = 7
    """[count] Noise of neighbouring lines is alike: so many are combined. Origin: e15b4fe3
    with docs/tuning-accuracy.md."""


class fit_problem:
    """`mechanics/identification/fit_problem.py`."""

    USUAL_DELAY_S = 60e-6
    """[s] Delays that no path shows are small: this one standard deviation, in s, next to the
    lines.
    Origin: 53a42117."""
    # USUAL_CORNER, CORNER_SPREAD: A speed filter that nothing states, log of Hz and its standard
    # deviation.
    CORNER_SPREAD = 1.0
    """[ratio] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    USUAL_ZERO = 0.1
    """[ratio] β of a mode is this share of ω at most in ordinary machines (one standard deviation).
    Origin: 53a42117."""
    # USUAL_DAMPING, DAMPING_SPREAD: Couplings have about this damping ratio, within a factor of e²
    # (one standard deviation).
    USUAL_DAMPING = 0.03
    """[ratio] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    DAMPING_SPREAD = 2.0
    """[ratio] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    INERTIA_ALIKE = 0.03
    """[ratio] What moves showed of the whole inertia holds for the response to this share at best
    (one deviation), as one is shown by the reported torque and the other by the commanded. Origin:
    7127804f."""
    NOISE = 0.3
    """[ratio] Lines with a larger relative deviation take no part. Origin: 53a42117."""
    OUTLIER = 3.0
    """[ratio] Residuals beyond this count linearly. Origin: 2f3875f1 with
    benchmarks/analysis_comparison."""
    NEAR_ANCHOR = (0.15, 0.15, 0.7)
    """[ratio] How far delays (cycles) and the filter (logarithm) go while mechanics are looked for.
    Origin: 2f3875f1 with benchmarks/analysis_comparison."""
    HIGHEST_TRIED = 4.0
    """[ratio] Highest antiresonance that is tried, relative to the highest line. Origin: 06d2dd3d
    with benchmarks/analysis_speed."""


class friction:
    """`mechanics/friction.py`."""

    LEAST_NOISE = 0.1
    """[ratio] No line is weighed as if its noise were less than this share of an ordinary line's.
    Origin: 06d2dd3d with benchmarks/analysis_speed."""
    LOWEST = 4.0
    """[ratio] Lines up to this multiple of the lowest are where friction rules, whatever else is
    nonlinear. Origin: d9add0c8 with benchmarks/tune_accuracy."""
    WORTH_TAKING = 0.9
    """[ratio] Friction is removed where that leaves less than this share of the scatter. Origin:
    06d2dd3d with benchmarks/analysis_speed."""
    # NOISE_ONLY, BY_NO_CHANCE: Where all scatter is noise (up to this multiple of it) friction is
    # there, however little it makes of it, once what it explains is so many times what a number
    # explains by chance (three deviations): leaving it in would be off by all of it.
    NOISE_ONLY = 2.0
    """[ratio] Origin: 41479a22."""
    BY_NO_CHANCE = 9.0
    """[ratio] Origin: 41479a22."""


class identify:
    """`mechanics/identification/identify.py`,
    `mechanics/identification/identification_trials.py`.
    """

    TRUSTED_ERROR = 0.03
    """[ratio] A model whose median relative misfit is larger, and larger than the noise, corrects
    nothing. Origin: 2c4e86b8."""
    LEFT_LATE = 0.3
    """[cycles] A path that leaves more cycles of delay than this is uncertain: others are tried.
    Origin: 52e73817 with docs/tuning-accuracy.md."""
    UNDECIDED = 80.0
    """[criterion] Paths whose criteria differ by less are both possible. Origin: 2730b30d."""
    PASSES = 4
    """[count] At most this many rounds of refining loop, path and mechanics against each other.
    Origin: 06d2dd3d with benchmarks/analysis_speed."""
    # UNSURE, WORTH_A_MODE: A mode whose part in the response is not known to this (logarithm, one
    # deviation) is tried without; it stays where that is worse by so much.
    UNSURE = 0.25
    """[log] Origin: 04cd1261."""
    WORTH_A_MODE = 80.0
    """[criterion] Origin: 04cd1261."""
    # HIDDEN, HIDDEN_SHARE: A line is hidden by friction where that may move it by so much; so many
    # are more than a few.
    HIDDEN = 0.1
    """[ratio] Origin: 04cd1261."""
    HIDDEN_SHARE = 0.03
    """[ratio] Origin: 04cd1261."""
    BALANCES = 2
    """[count] Rounds of friction by the balance of torques and mechanics by what that leaves.
    Origin: 04cd1261."""
    AS_ALIKE = 1.02
    """[ratio] Realisations are as alike as before up to this multiple of what they differ by.
    Origin: 42ed8d1c."""
    AVERAGED = 0.5
    """[ratio] What is left of a distortion along one axis of the complex plane, two draws averaged.
    Origin: fa2afbb4."""
    # STEP, SETTLED, LONGEST_STEP: Path parameters are moved by this much (cycles, logarithm) to see
    # what they do, moved at all where torque and motion together put them further off than this
    # share of their deviation, and by no more than two deviations or this at once.
    STEP = 0.02
    """[ratio] Origin: 04cd1261."""
    SETTLED = 0.2
    """[ratio] Origin: 04cd1261."""
    LONGEST_STEP = 0.1
    """[ratio] Origin: 04cd1261."""
    # BY_MOTION, CLEARLY: A path by the motion alone is used where the criterion is better by so
    # much and the misfit is smaller than this share: chosen by hand on a few axes of
    # `benchmarks.rough_campaign`, where filtered or copied torques left about 1.4 to 10 times the
    # misfit. Those that leave less than 1.3 times are not noticed by this; what right ones leave
    # was not tabulated.
    BY_MOTION = 60.0
    """[criterion] Origin: ed1a5f9a with benchmarks/rough_campaign."""
    CLEARLY = 0.77
    """[ratio] Origin: ed1a5f9a with benchmarks/rough_campaign."""
    # BY_FAR, FAR_CLEARLY: So much better, and so much smaller, it is used before the path by the
    # torque is fitted again.
    BY_FAR = 600.0
    """[criterion] Origin: bf47af74."""
    FAR_CLEARLY = 0.4
    """[ratio] Origin: bf47af74."""
    MOTION_PASSES = 3
    """[count] Rounds of refining a path that was found from the motion. Origin: 4d353715."""
    EXPLAINED = 0.0035
    """[ratio] A median misfit (relative) that a path by the motion leaves where it is right.
    Origin: 4d353715."""
    # ORDINARY_HZ, SLOW_HZ: Current loops are within these, and one behind a low-pass of the torque
    # begins about here, in Hz.
    ORDINARY_HZ = (450.0, 1600.0)
    """[Hz] Origin: 4d353715."""
    SLOW_HZ = 300.0
    """[Hz] Origin: 4d353715."""
    # LEFT_BY_TORQUE_S, TORQUE_LEFT, ROUNDED: A torque that is the mechanics' leaves less delay (s)
    # than this, and less of itself unexplained by hold, corner and delay (relative RMS; rounding to
    # 0.1 % leaves 0.001 to 0.005 on the axes of `benchmarks.tune_accuracy`).
    LEFT_BY_TORQUE_S = 60e-6
    """[s] Origin: b5417685 with benchmarks/rough_campaign."""
    TORQUE_LEFT = 0.02
    """[ratio] Origin: b5417685 with benchmarks/rough_campaign."""
    ROUNDED = 0.005
    """[ratio] Origin: b5417685 with benchmarks/rough_campaign."""
    # PASSIVE_DEG, PASSIVE_SHARE, COHERENT, FEW: Lines whose phase is beyond ±90° by more than this,
    # and their share, are not those of a passive axis; lines that take part.
    PASSIVE_DEG = 12.0
    """[deg] Origin: 4d353715."""
    PASSIVE_SHARE = 0.1
    """[ratio] Origin: 4d353715."""
    COHERENT = 0.9
    """[ratio] Origin: 4d353715."""
    FEW = 12
    """[count] Origin: 4d353715."""
    # FRACTION, EARLY: What half a cycle of delay weighs, in the criterion's units, is half of this;
    # and what a cycle by which a drive would report too early does.
    FRACTION = 100.0
    """[criterion] Origin: 2730b30d."""
    EARLY = 2e3
    """[criterion] Origin: 2730b30d."""


class inertia:
    """`mechanics/slow_moves/inertia.py`."""

    SYSTEMATIC_SHARE = (0.005, 0.05, 0.03, 0.01)
    """[ratio] Shares of J, viscous, Coulomb and gravity torque by which compliance, timing and the
    smoothing of standstill bend the answer however little noise there is; part of every interval.
    Origin: 64a6c047."""
    SWINGS_TO = 2.0
    """[ratio] Swings are looked for up to this multiple of the smoothing's corner; above, their
    first order is enough. Origin: 0f3c9bfa."""
    ALIKE_S = 0.2
    """[s] What the model leaves may be alike for about this long. Origin: 0f3c9bfa."""
    FEWEST = 20
    """[count] Fewer samples give no regression. Origin: 0f3c9bfa."""
    SAMPLED_S = 25e-6
    """[s] Half of a drive's loop period of 50 µs, within which torque and position are sampled.
    Origin: tests/unit/analysis/test_analysis_inertia.py."""
    LATER_S = 50e-6
    """[s] A torque that is later than the motion by more than a loop period may be that of
    setpoints that are held. Origin: tests/unit/analysis/test_analysis_inertia.py."""
    DISTINGUISHED = 0.01
    """[ratio] Share of the Coulomb friction that may have been mistaken for viscous friction.
    Origin: f9af5d30 with benchmarks/chaos/run."""


class inertia_by_place:
    """`mechanics/identification/inertia_by_place.py`."""

    SHARE = 0.2
    """[ratio] Lines to this share of the sample rate: products of motions are folded above. Origin:
    426adb36."""
    # SURE, LEAST: A part that stands out by so many deviations, and is this share of the inertia,
    # is there.
    SURE = 5.0
    """[ratio] Origin: 426adb36."""
    LEAST = 0.01
    """[ratio] Origin: 426adb36."""
    FEW = 12
    """[count] Fewer lines say nothing of an inertia that depends on the place. Origin: 17b160fe."""


class load_search:
    """`mechanics/identification/load_search.py`."""

    LOWEST_TRIED = 1.3
    """[ratio] Antiresonances that are tried, from this multiple of the lowest line. Origin:
    06d2dd3d with benchmarks/analysis_speed."""
    # APART, APART_FOLDED, FOLDED: Starts nearer to each other than this (logarithm of their
    # frequencies) lead to the same place, but for what is seen by its images alone: that fits at
    # many places which lie close together.
    APART = 0.5
    """[ratio] Origin: 2f3875f1 with benchmarks/analysis_comparison."""
    APART_FOLDED = 0.12
    """[ratio] Origin: 2f3875f1 with benchmarks/analysis_comparison."""
    FOLDED = 4
    """[count] Origin: 2f3875f1 with benchmarks/analysis_comparison."""
    LATE = 0.1
    """[cycles] A start is moved by this much (cycles) to where its delay fits. Origin: 9fb66904."""
    SEARCHED_HZ = 2000.0
    """[Hz] Images of up to about this frequency are looked at in a search. Origin: ba36ea00 with
    benchmarks/tune_accuracy."""
    RATIOS = (0.05, 0.12, 0.25, 0.5, 1.0, 2.0, 5.0, 12.0, 30.0)
    """[ratio] Inertia of one more load, relative to the one that it hangs on. Origin: 53a42117."""


class load_swing:
    """`mechanics/slow_moves/load_swing.py`."""

    # STEP, DAMPINGS: What the search looks at: ratios of neighbouring frequencies, and dampings.
    STEP = 1.07
    """[ratio] Origin: 0f3c9bfa."""
    DAMPINGS = (0.008, 0.03, 0.1)
    """[ratio] Origin: 0f3c9bfa."""
    # LEAST_DAMPING, MOST_DAMPING: Bounds of the damping of a load that oscillates.
    LEAST_DAMPING = 5e-4
    """[ratio] Origin: 0f3c9bfa."""
    MOST_DAMPING = 0.5
    """[ratio] Origin: 0f3c9bfa."""
    LOWEST_HZ = 3.0
    """[Hz] Below this frequency a swing is not distinguished from the move itself. Origin:
    0f3c9bfa."""
    WORTH = 0.5
    """[ratio] A mode must take this share of the power that is left, or it is not there to be seen.
    Origin: 0f3c9bfa."""
    DIFFERENCE = 1e-4
    """[ratio] Relative step of numerical slopes. Origin: 0f3c9bfa."""
    PER_CYCLE = 8.0
    """[ratio] Samples per cycle of the highest frequency that are worth regressing over. Origin:
    0f3c9bfa."""


class load_terms:
    """`mechanics/slow_moves/load_terms.py`."""

    PLAIN = 0.5
    """[ratio] A term that takes this share of the power that is left is there, whatever the noise.
    Origin: 6673eb21."""
    # SHARE, F: Next to noise a smaller share counts for a fan and for the machine's place, which
    # bend inertia most: least share, and least ratio of variances (F) for the three things that are
    # fitted.
    SHARE = 0.15
    """[ratio] Origin: 6673eb21."""
    F = 20.0
    """[ratio] Origin: 6673eb21."""
    # LEAST, LEAST_OF_FRICTION: Of the largest torque, what takes less matters to nobody; of the
    # Coulomb friction, the shape of friction itself is not known better.
    LEAST = 0.01
    """[ratio] Origin: 6673eb21."""
    LEAST_OF_FRICTION = 0.1
    """[ratio] Origin: 6673eb21."""
    PLACES = 4
    """[count] An arm may hang on a shaft that is out of balance, of a motor that cogs in two ways.
    Origin: a3ccf14b with docs/tuning-accuracy.md."""
    STATIC = (0.01, 0.02, 0.04, 0.08)
    """[ratio] Speeds within which friction falls to its Coulomb value, as shares of the highest.
    Origin: a3ccf14b with docs/tuning-accuracy.md."""
    DIFFERENCE = 1e-3
    """[ratio] Relative step of numerical slopes. Origin: 6673eb21."""
    CRANKS = (1.0, 2.0)
    """[1/rev] Variations of the inertia that are tried, per turn of the motor: an eccentric load
    and a crank. Origin: tests/unit/analysis/test_analysis_load_terms.py."""
    # REST_LENGTHS, RESTS, RESTS_STEP: Ways over which friction rises after a reversal that are
    # tried, how many of them stand for one law, and the relative step of numerical slopes.
    REST_LENGTHS = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4)
    """[rad] Origin: tests/unit/analysis/test_analysis_load_terms.py."""
    RESTS = 2
    """[count] Origin: tests/unit/analysis/test_analysis_load_terms.py."""
    RESTS_STEP = 0.2
    """[ratio] Origin: tests/unit/analysis/test_analysis_load_terms.py."""


class mode_uncertainty:
    """`mechanics/identification/mode_uncertainty.py`."""

    SYSTEMATIC = (3e-4, 0.03, 0.0)
    """[ratio] What path and interpolation leave of frequency and damping however long one measures,
    and of damping where the friction that every axis has did not show, and so is still in the
    lines. Origin: 04cd1261."""
    UNSEEN_FRICTION = (0.0, 0.1, 0.0)
    """[ratio] Added standard deviation (frequency, damping, residue) where no friction was seen.
    Origin: 04cd1261."""
    WIDEST = 10.0
    """[ratio] A larger deviation of a damping says no more than that nothing is known. Origin:
    41479a22."""
    STEP = 1e-5
    """[ratio] Parameters (most are logarithms) are moved by this much to see what the modes do.
    Origin: 04cd1261."""


class model_fit:
    """`mechanics/identification/model_fit.py`."""

    # WORTHWHILE, MODES_GAIN: One more load must gain this much, free modes instead of a chain that
    # much.
    WORTHWHILE = 10.0
    """[criterion] Origin: 53a42117."""
    MODES_GAIN = 60.0
    """[criterion] Origin: 53a42117."""
    # COARSE_LINES, COARSE_STEPS, FINISHED: A first look takes about twice so many lines and so many
    # steps; so many starts get further.
    COARSE_LINES = 40
    """[count] Origin: 9fb66904."""
    COARSE_STEPS = 12
    """[count] Origin: 9fb66904."""
    FINISHED = 4
    """[count] Origin: 9fb66904."""
    # LEAST_COHERENCE, FLOOR: Lines with less coherence take no part, and none is trusted to be
    # more accurate than this.
    LEAST_COHERENCE = 0.6
    """[ratio] Origin: 2f3875f1 with benchmarks/analysis_comparison."""
    FLOOR = 0.01
    """[ratio] Origin: 2f3875f1 with benchmarks/analysis_comparison."""
    # WORSE, EXPLAINED: Ends that are worse by so much are not followed; below this misfit nothing
    # more is hidden.
    WORSE = 60.0
    """[criterion] Origin: d9add0c8 with benchmarks/tune_accuracy."""
    EXPLAINED = 0.003
    """[ratio] Origin: d9add0c8 with benchmarks/tune_accuracy."""
    # LATE, ABOVE_NOISE: A delay is searched for where the misfit is larger than this, and than this
    # multiple of the deviation of the lines: noise is no delay.
    LATE = 0.05
    """[ratio] Origin: 53a42117."""
    ABOVE_NOISE = 1.5
    """[ratio] Origin: identify.TRUSTED_ERROR, whose comparison with the noise it is."""
    FREED = 0.1
    """[ratio] Below this misfit mechanics are there, and delays and filter are free. Origin:
    2f3875f1 with benchmarks/analysis_comparison."""


class position_torque:
    """`mechanics/slow_moves/position_torque.py`."""

    LONGEST = 8.0
    """[ratio] The longest period looked for, in ways of the move: a sine is a straight line and a
    bow there. Origin: 6673eb21."""
    SHORTEST_REV = 0.9
    """[rev] Shortest period that is searched, in turns of the motor. Origin: a3ccf14b with
    docs/tuning-accuracy.md."""
    STEP = 1.12
    """[ratio] Ratio of neighbouring periods of the search. Origin: 6673eb21."""
    ROWS = 2000
    """[count] Rows that are enough for torques as slow as these. Origin: 6673eb21."""


class resonance_table:
    """`mechanics/identification/resonance_table.py`."""

    LOWEST_MODE_HZ = 15.0
    """[Hz] Weak modes below this are artefacts of friction more often than mechanics. Origin:
    76d84383."""
    # WEAK_DB, LEAST_DB, LEAST_SHARE: A low mode is listed where it is higher than the first over
    # its surroundings; any mode from the second on; a mode is seen from this share of the line's
    # magnitude.
    WEAK_DB = 3.0
    """[dB] Origin: 53a42117."""
    LEAST_DB = 1.0
    """[dB] Origin: 53a42117."""
    LEAST_SHARE = 0.2
    """[ratio] Origin: 53a42117."""


class reversals:
    """`mechanics/reversals.py`."""

    # ROUGH, LEAST_WEIGHT: Where the balance is off by more than this (one deviation, of the Coulomb
    # torque) the sampled speed shows more. It shows an interval to 0.3; but errors of the balance
    # are those of speeds at samples, which cancel from one interval to the next, so that it is
    # better on the lower lines.
    ROUGH = 0.4
    """[ratio] Origin: 04cd1261."""
    LEAST_WEIGHT = 0.5
    """[ratio] Origin: 04cd1261."""
    # SLOW, JITTER: What the balance is off by is shown by so many intervals to each side, to this
    # share.
    SLOW = 12
    """[count] Origin: 04cd1261."""
    JITTER = 0.01
    """[ratio] Origin: 04cd1261."""
    FEWEST = 50
    """[count] Fewer intervals without a reversal say nothing of the balance. Origin: 04cd1261."""


class robust_fit:
    """`mechanics/identification/robust_fit.py`."""

    # LEAST_DAMPING, MOST_DAMPING: Bounds of the damping of the Levenberg-Marquardt steps.
    LEAST_DAMPING = 1e-9
    """[ratio] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    MOST_DAMPING = 1e9
    """[ratio] Origin: 06d2dd3d with benchmarks/analysis_speed."""


class stribeck:
    """`mechanics/stribeck.py`."""

    EXPONENTS = (0.5, 1.0, 1.5, 2.0)
    """[ratio] Exponents of the Stribeck curve that are tried. Origin: 16e1fbc9."""
    GRID = 48
    """[count] Stribeck speeds that are tried, spaced evenly by ratio. Origin: 16e1fbc9."""
    # FEWEST, NEAR: Fewer speeds say nothing of a Stribeck curve; of its height only what is this
    # near to it.
    FEWEST = 5
    """[count] Origin: 16e1fbc9."""
    NEAR = 0.6
    """[ratio] Origin: 16e1fbc9."""
    ALIKE = 3.84
    """[ratio] Rise of the weighted squares within which a pair is as good as the best (chi-squared,
    95 %). Origin: 16e1fbc9."""
    # BEYOND, SHARE: A point differs from the model beyond its interval times this, and this share
    # of its torque.
    BEYOND = 2.0
    """[ratio] Origin: 16e1fbc9."""
    SHARE = 0.03
    """[ratio] Origin: 16e1fbc9."""
    CURVE = 60
    """[count] Points of the curve that a page draws. Origin: 16e1fbc9."""


class collocated:
    """`response/foreign_recordings/collocated.py`."""

    # TOLERATED_DEG, IN_A_ROW: Lines beyond ±90° by more than this and their band contradict; so
    # many in a row are no chance.
    TOLERATED_DEG = 12.0
    """[deg] Origin: 5e3e694a."""
    IN_A_ROW = 4
    """[count] Origin: 5e3e694a."""
    HIGHEST_POLE = 4.0
    """[ratio] A friction pole above this share of the lowest line leaves the inertia to a guess.
    Origin: 5e3e694a."""


class distortion:
    """`response/distortion.py`."""

    # REACH, FEWEST: Empty bins that a level is calculated over, to each side, and the fewest that
    # show anything.
    REACH = 6
    """[count] Origin: fa2afbb4."""
    FEWEST = 12
    """[count] Origin: fa2afbb4."""
    SILENT = 1e-3
    """[ratio] What a bin that is left out may hold of what an excited one does: rounding, and
    nothing else. Origin: bb6a6f7c."""
    CONTRADICTED = 0.5
    """[ratio] What the position shows less than this share of is noise of the reported speed. (What
    moves above half the sample rate is folded into both, into the position less.) Origin:
    d76660a9."""
    ROUNDING = 1e-9
    """[ratio] Places of the axis that differ by less, relative to its way, are the same. Origin:
    b188216d."""
    LOWEST = 0.1
    """[ratio] Play is looked for above this share of the sample rate: below, friction rules.
    Origin: fa2afbb4."""
    # MUCH, SOME, UNEXPLAINED: So much of the motion is too much, in any case or where friction
    # explains none of it.
    MUCH = 0.17
    """[ratio] Origin: fa2afbb4."""
    SOME = 0.1
    """[ratio] Origin: fa2afbb4."""
    UNEXPLAINED = 0.9
    """[ratio] Origin: fa2afbb4."""
    # SLOW, ABOUT_S: About standstill: speed below this share of its deviation, and so long before
    # and after.
    SLOW = 0.1
    """[ratio] Origin: d9add0c8 with benchmarks/tune_accuracy."""
    ABOUT_S = 0.002
    """[s] Origin: d9add0c8 with benchmarks/tune_accuracy."""
    # AT_REVERSALS, LEAST_TIME: What is so much stronger there than elsewhere is friction; so little
    # of the time says nothing.
    AT_REVERSALS = 1.4
    """[ratio] Origin: d9add0c8 with benchmarks/tune_accuracy."""
    LEAST_TIME = 0.01
    """[ratio] Origin: d9add0c8 with benchmarks/tune_accuracy."""
    ABOVE_NOISE = 4.0
    """[ratio] Power on the empty bins over that of the noise in it, from which on it indicates
    backlash.
    Origin: fa2afbb4."""
    # HIGHEST, FAR_ABOVE_NOISE: Where noise rules below, play may show above this share of the
    # sample rate, where it moves the motor alone; so much above the noise there.
    HIGHEST = 0.3
    """[ratio] Origin: 29633e14."""
    FAR_ABOVE_NOISE = 5.0
    """[ratio] Origin: 29633e14."""


class excitation_found:
    """`response/foreign_recordings/excitation_found.py`."""

    # UNLIKE, UNLIKE_TWICE, AS_MUCH: Two passes of a period that differ by more than this share of
    # the power are not the same: where all later ones are as much alike, and where there are two
    # alone.
    UNLIKE = 0.3
    """[ratio] Origin: tests/unit/analysis/test_foreign_response.py."""
    UNLIKE_TWICE = 0.05
    """[ratio] Origin: 855a6a86."""
    AS_MUCH = 0.1
    """[ratio] Origin: tests/unit/analysis/test_foreign_response.py."""
    # SILENT, PARTS: An input is silent below this share of its usual size, over so many parts of
    # the record.
    SILENT = 0.1
    """[ratio] Origin: tests/unit/analysis/test_foreign_response.py."""
    PARTS = 200
    """[count] Origin: tests/unit/analysis/test_foreign_response.py."""
    # NO_PASS, OF_PERIOD: Two parts of passes that differ by more than this, relative to the power
    # of each of them, are none (2 where they have nothing in common); so many parts are looked at
    # in a period.
    NO_PASS = 1.0
    """[ratio] Origin: tests/unit/analysis/test_foreign_response.py."""
    OF_PERIOD = 16
    """[count] Origin: tests/unit/analysis/test_foreign_response.py."""
    AS_GOOD = 0.01
    """[ratio] The shortest lag whose correlation comes this near to the best one is the period.
    Origin: 855a6a86."""
    # LEAST_PERIOD, LEAST_PERIODS: Shortest period in samples, and fewest periods that make a record
    # periodic.
    LEAST_PERIOD = 16
    """[count] Origin: 855a6a86."""
    LEAST_PERIODS = 2
    """[count] Origin: 855a6a86."""
    # LEAST_SHARE, DEVIATIONS: A line is excited above this share of the strongest one, and above
    # this many deviations.
    LEAST_SHARE = 0.01
    """[ratio] Origin: 855a6a86."""
    DEVIATIONS = 6.0
    """[ratio] Origin: 855a6a86."""
    GAP = 2.5
    """[ratio] Amplitudes part into excited and not where neighbours in order differ by this factor.
    Origin: 855a6a86."""
    # ONE_TONE, ONE_WAY, SLOW_BINS: Of a chirp, one frequency holds this share of the power of each
    # moment, and moves on as before. The lowest bins of a moment hold its slow motion.
    ONE_TONE = 0.6
    """[ratio] Origin: 855a6a86."""
    ONE_WAY = 0.85
    """[ratio] Origin: 855a6a86."""
    SLOW_BINS = 3
    """[count] Origin: tests/unit/analysis/test_foreign_response.py."""
    TRANSIENT = 4.0
    """[ratio] The first periods hold the transient while they differ so many times more than the
    later ones. Origin: 855a6a86."""


class foreign:
    """`response/foreign_recordings/foreign.py`."""

    # LEAST_LINES, LEAST_SAMPLES: Fewer lines, or samples, are no frequency response.
    LEAST_LINES = 12
    """[count] Origin: 855a6a86."""
    LEAST_SAMPLES = 256
    """[count] Origin: 855a6a86."""
    # LEAST_SPAN, MOST_SPAN: From the lowest to the highest sample, in the signal's unit: fourth
    # powers of it, and over the other signal's, are floats.
    LEAST_SPAN = 1e-70
    """[count] Origin: tests/unit/analysis/test_foreign_response.py."""
    MOST_SPAN = 1e70
    """[count] Origin: tests/unit/analysis/test_foreign_response.py."""
    LINES = 400
    """[count] Lines of a record without periods; more say nothing more. Origin: 855a6a86."""
    EXCITED_DB = -30.0
    """[dB] Of an input without periods, frequencies that carry this share of the strongest are
    excited. Origin: 855a6a86."""
    COHERENT = 0.5
    """[ratio] Lines less coherent than this are left out of the fit, and end the band. Origin:
    855a6a86."""
    # KNOWN, MOST_OF_A_LINE: The output follows the input where the squares of the lines over their
    # variances exceed the first in the mean over neighbours; a single line counts up to the second.
    # Without any relation that mean is 1.1 with a deviation of 0.4; 4 is a noise of 0.35 per
    # component.
    KNOWN = 4.0
    """[ratio] Origin: tests/unit/analysis/test_foreign_response.py."""
    MOST_OF_A_LINE = 16.0
    """[ratio] Origin: tests/unit/analysis/test_foreign_response.py."""
    FEWEST_EMPTY = 8
    """[count] Empty lines that show distortion, at least. Origin: 855a6a86."""
    POOL_EMPTY = 8
    """[count] Lines to each side whose distortion, or whose correlation from period to period, is
    looked at together. Origin: tests/unit/analysis/test_foreign_rough.py."""
    FEWEST_ALIKE = 4
    """[count] Fewer periods do not show whether they resemble their predecessors. Origin:
    tests/unit/analysis/test_foreign_rough.py."""
    ENDS = 16
    """[count] The ends of a period are so small a part of it: long enough to average noise, short
    enough to see where the period begins and ends. Origin:
    tests/unit/analysis/test_foreign_rough.py."""
    # FEEDBACK, MOST_FEEDBACK: One deviation of what feedback adds, relative to the share of noise:
    # |T| of a damped loop is at most 1.3 to 2, which 1.96 deviations are to reach. A larger share
    # of noise than the second says no more.
    FEEDBACK = 0.75
    """[ratio] Origin: tests/unit/analysis/test_foreign_rough.py."""
    MOST_FEEDBACK = 4.0
    """[ratio] Origin: tests/unit/analysis/test_foreign_rough.py."""
    LESS_NOISE = 0.7
    """[ratio] Each period has a slope of its own where that leaves less than this of the noise.
    Origin: tests/unit/analysis/test_foreign_rough.py."""


class frf:
    """`response/frf.py`."""

    # BY_SPEED, BY_BALANCE, EACH_BY_BALANCE: What friction did to a line is off by this share where
    # only the speed shows its direction, and where the balance of torques does at reversals: all
    # lines alike, as too little or too much friction makes them, and each line by itself, in size
    # and phase.
    BY_SPEED = 0.2
    """[ratio] Origin: 41479a22."""
    BY_BALANCE = 0.08
    """[ratio] Origin: 41479a22."""
    EACH_BY_BALANCE = 0.1
    """[ratio] Origin: 41479a22."""


class local_polynomial:
    """`response/foreign_recordings/local_polynomial.py`."""

    SPARE = 10
    """[count] Equations of a window beyond its unknowns, which show the scatter. Origin:
    855a6a86."""


class modes_found:
    """`response/foreign_recordings/modes_found.py`."""

    LEAST_DB = 3.0
    """[dB] A peak or valley stands out so much from the curve, without its slope. Origin:
    855a6a86."""
    NEAR = 0.06
    """[ratio] A pair belongs to an extremum that is nearer than this share. Origin: 855a6a86."""
    FLOOR = 1e-3
    """[ratio] No frequency is known better than the clock and the structure of the model allow.
    Origin: 855a6a86."""
    DAMPING_FLOOR = 0.15
    """[ratio] Nor a damping, which friction and backlash change with the level (logarithm, one
    deviation). Origin: 5e3e694a."""


class path_fit:
    """`response/signal_path/path_fit.py`."""

    MOST_CYCLES = 3.5
    """[cycles] Setpoints are in force after this many cycles at most. Origin: 06d2dd3d with
    benchmarks/analysis_speed."""
    PARTS = (0.0, 0.25, 0.5, 0.75, 0.88, 0.94)
    """[ratio] Parts of a cycle that a search begins with. Origin: d9add0c8 with
    benchmarks/tune_accuracy."""
    # WHOLE_CYCLES, ORDINARY: What is usual (whole cycles of delay, an ordinary current loop) weighs
    # this much, relative to the whole torque: it decides only where nothing else does, for above
    # about the sample rate corner and a fraction of a cycle look alike.
    WHOLE_CYCLES = 2e-3
    """[cycles] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    ORDINARY = 1e-4
    """[ratio] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    SCALE = 1e4
    """[ratio] Scale of the residuals in the search of delay and corner. Origin: 06d2dd3d with
    benchmarks/analysis_speed."""
    OWN_SHARE = 0.15
    """[ratio] Speed and its torque are sampled signals: trusted up to about this share of the
    sample rate. Origin: 06d2dd3d with benchmarks/analysis_speed."""
    ALIKE = 3.0
    """[ratio] Another hold is worth a trial when it leaves less than this multiple unexplained.
    Origin: 06d2dd3d with benchmarks/analysis_speed."""
    NEARLY = 1.5
    """[ratio] A delay of whole cycles that leaves less than this multiple of what a fraction does
    is taken. Origin: d9add0c8 with benchmarks/tune_accuracy."""
    WHOLE = 0.06
    """[cycles] A delay so near to whole cycles is one of whole cycles. Origin: 95cec73e."""
    # STEADY, UNSTEADY, REPORTED, UNTOLD: Deviations of delays (cycles) and of corners (logarithm)
    # where nothing but habit shows them.
    STEADY = 0.02
    """[ratio] Origin: f9af5d30 with benchmarks/chaos/run."""
    UNSTEADY = 0.1
    """[ratio] Origin: f9af5d30 with benchmarks/chaos/run."""
    REPORTED = 0.03
    """[ratio] Origin: f9af5d30 with benchmarks/chaos/run."""
    UNTOLD = 0.7
    """[ratio] Origin: f9af5d30 with benchmarks/chaos/run."""
    ROUNDING = 1.5e-7
    """[ratio] So much stays unexplained by rounding alone. Origin: 06d2dd3d with
    benchmarks/analysis_speed."""


class product_model:
    """`response/foreign_recordings/product_model.py`."""

    WORTH = 0.8
    """[ratio] A further pair must leave less than this of what the lines differ by from the model.
    Origin: 855a6a86."""
    WORTH_REAL = 0.85
    """[ratio] Further real poles cost little and must be worth it, too. Origin: 855a6a86."""
    # MOST_PAIRS, MOST_REAL: Most pairs of poles and zeros, and most real poles.
    MOST_PAIRS = 4
    """[count] Origin: 5e3e694a."""
    MOST_REAL = 3
    """[count] Origin: 5e3e694a."""
    STEPS = 30
    """[count] Most evaluations of one fit. Origin: 5e3e694a."""
    WHITE = 0.2
    """[ratio] Residuals of neighbours that correlate less than this are scatter, which no mode
    explains. Origin: 5e3e694a."""
    # GRID, START_DAMPING: Places where a further pair is begun, and the damping it begins with.
    GRID = 36
    """[count] Origin: 855a6a86."""
    START_DAMPING = (0.02, 0.1)
    """[ratio] Origin: 855a6a86."""
    DAMPING = (5e-4, 0.5)
    """[ratio] Damping and delay stay within; pairs up to this far beyond the lines. Origin:
    855a6a86."""
    BEYOND = 1.3
    """[ratio] Pairs may lie this factor beyond the lines. Origin: 855a6a86."""


class reference_gain:
    """`response/signal_path/reference_gain.py`."""

    UNRELATED = 0.5
    """[ratio] A torque of which more than this share (power) is not made of the reference does not
    follow it. Origin: 2f3875f1 with benchmarks/analysis_comparison."""
    SLOWEST_HZ = 0.2
    """[Hz] A slower integral than this makes no torque worth speaking of within a measurement.
    Origin: c71e9acb."""
    # SAME_GAIN, SAME_CORNER: Gains and current loops that differ by less are the same.
    SAME_GAIN = 0.003
    """[ratio] Origin: 7bd7faec."""
    SAME_CORNER = 0.03
    """[ratio] Origin: 7bd7faec."""


class reference_path:
    """`response/signal_path/reference_path.py`."""

    OFF = 0.02
    """[ratio] What a line may be off by, whatever its scatter says (logarithm). Origin:
    17b160fe."""
    STEADY_CYCLES = 0.3
    """[cycles] A drive in step with the bus takes references at its cycles: one deviation, in
    cycles. Where the path that the mechanics showed is the one that explains the loop, nothing else
    is looked for. Origin: 17b160fe."""
    # LOOP_LATE_S, LOOP_SIZE: What a loop's delay and size may differ by from the prediction, one
    # deviation: loop periods of 62.5 to 250 µs where 50 µs are assumed.
    LOOP_LATE_S = 100e-6
    """[s] Origin: 17b160fe."""
    LOOP_SIZE = 0.3
    """[ratio] Origin: 17b160fe."""
    SURE = 3.0
    """[ratio] A delay is put right where it is so many deviations from the assumed one. Origin:
    17b160fe."""
    ALIKE = 1.25
    """[ratio] Holds whose misfit differs by less than this share are both possible. Origin:
    17b160fe."""
    FEW = 12
    """[count] Fewer lines say nothing of a path. Origin: 17b160fe."""


class repeat_band:
    """`response/foreign_recordings/repeat_band.py`."""

    # REACH, POOL: Lines to each side of the local parabola, and of the mean of what it leaves.
    REACH = 6
    """[count] Origin: 855a6a86."""
    POOL = 8
    """[count] Origin: 855a6a86."""
    # MODE_SHIFT, DAMPING_SHIFT: One deviation each, fitted to simulated benches (two masses with
    # Coulomb and Stribeck friction, backlash, ripple; 0.5 to 2 times the level):
    # `benchmarks/import_accuracy.py` prints the coverage.
    MODE_SHIFT = 0.004
    """[ratio] Origin: c7efa439."""
    DAMPING_SHIFT = 0.25
    """[ratio] Origin: c7efa439."""
    FRICTION_SHIFT = 0.5
    """[ratio] The pole that friction makes goes with 1/level: at half the level it has twice its
    frequency, which 1.96 deviations are to reach. Origin: c7efa439."""
    FRICTION_BELOW = 2.0
    """[ratio] A pole is friction's, not a filter's, up to so many times the lowest line. Origin:
    855a6a86."""
    # BY_TEMPERATURE, BY_PLACE: Gain of any two runs: by temperature of magnets and amplifier (1 %),
    # and by the place where each of them happens to stand, as a motor's torque goes with its place
    # by 1 to 3 % (two places of a ripple of 2 % differ by 2 %, one deviation). A run that hardly
    # travels shows nothing of it.
    BY_TEMPERATURE = 0.01
    """[ratio] Origin: c7efa439."""
    BY_PLACE = 0.02
    """[ratio] Origin: c7efa439."""


class load_response:
    """`response/load_response.py`."""

    FEWEST = 100
    """[count] Samples below which a recording shows no scale. Origin: a571816a."""
    LEFT = 0.02
    """[ratio] An encoder does not follow the motor where more than this share of the power of its
    motion is not the motor's. Origin: a571816a."""
    NEAR = 9
    """[lines] So many lines around one have an error of the torque in common. Origin: a571816a."""


class reported:
    """`response/reported_signals/reported.py`."""

    # MOST_CYCLES, SAME: A speed may be a mean over so many cycles; it is one where half of the
    # upper lines differ by less.
    MOST_CYCLES = 16
    """[cycles] Origin: 910909b1 with benchmarks/autotune_accuracy."""
    SAME = 0.01
    """[ratio] Origin: 910909b1 with benchmarks/autotune_accuracy."""
    # COMMANDED_HZ, USUAL_HZ: A torque that follows its command faster than this is the command;
    # current loops are slower.
    COMMANDED_HZ = 3500.0
    """[Hz] Origin: 910909b1 with benchmarks/autotune_accuracy."""
    USUAL_HZ = 1000.0
    """[Hz] Origin: 910909b1 with benchmarks/autotune_accuracy."""
    # SLOWEST_HZ, LATE_S: A lag that is not reported is not slower, and what is left of its delay,
    # one deviation.
    SLOWEST_HZ = 250.0
    """[Hz] Origin: cf5eb651."""
    LATE_S = 60e-6
    """[s] Origin: cf5eb651."""


class reported_demand:
    """`response/reported_signals/reported_demand.py`."""

    # AT_ONCE_HZ, CLEARLY: A torque follows at once where this corner leaves less than this share of
    # what an ordinary current loop does.
    AT_ONCE_HZ = 2e4
    """[Hz] Origin: reported.COMMANDED_HZ, well above."""
    CLEARLY = 0.4
    """[ratio] Origin: docs/tuning-accuracy.md, campaign of 27 November 2026."""


class reported_speed:
    """`response/reported_signals/reported_speed.py`."""

    FINER = 8
    """[count] Samples between two samples for a derivative. Origin: line_spectra.FINER."""
    UNKNOWN_DB = 1e3
    """[dB] Deviation of lines that do not count. Origin: larger than any line's."""
    # EXPLAINED, ABOVE_NOISE: Mechanics explain a view to this median misfit, or to this multiple of
    # the deviation of its lines.
    EXPLAINED = 0.006
    """[ratio] Origin: docs/tuning-accuracy.md, campaign of 27 November 2026."""
    ABOVE_NOISE = 1.5
    """[ratio] Origin: docs/tuning-accuracy.md, campaign of 27 November 2026."""
    # UNEXPLAINED, CLEARLY: A speed that leaves so much unexplained, or without which the position
    # is explained to this share, is not used.
    UNEXPLAINED = 0.02
    """[ratio] Origin: docs/tuning-accuracy.md, campaign of 27 November 2026."""
    CLEARLY = 0.77
    """[ratio] Origin: identify.CLEARLY."""
    # COHERENT, FEW: Lines whose ratio of speed to position is compared, and how many at least.
    COHERENT = 0.9
    """[ratio] Origin: identify.COHERENT."""
    FEW = 12
    """[count] Origin: identify.FEW."""


class sampled_model:
    """`response/signal_path/sampled_model.py`."""

    HIGHEST_IMAGE_HZ = 6000.0
    """[Hz] Nothing comes back from above this, whatever the sample rate. Origin: 53a42117."""


class sampling:
    """`response/signal_path/sampling.py`."""

    DIRECT_SHARE = 0.25
    """[ratio] Direct estimates hold to this share of the sample rate, sampled-data models to the
    second. Origin: 0dbf17e5."""
    MODEL_SHARE = 0.4
    """[ratio] Sampled-data models hold to this share of the sample rate. Origin: 0dbf17e5."""
    STEP_LEAD_S = 25e-6
    """[s] A drive interpolates in the steps of its own loop (50 µs) and so is half a step ahead of
    a line. Origin: 53a42117."""
    USUAL_CURRENT_HZ = 1000.0
    """[Hz] An ordinary current loop's corner, where nothing states one. Origin: 4d353715."""


class stated_band:
    """`response/stated_band.py`."""

    SYSTEMATIC_DB = 0.05
    """[dB] One standard deviation of what hold, lag and delay leave unexplained however long one
    measures. Origin: 099fcd55."""
    SYSTEMATIC_DEG = 0.35
    """[deg] One standard deviation of the phase that hold, lag and delay leave unexplained. Origin:
    099fcd55."""
    IMAGES_LEFT = 0.08
    """[ratio] So much of what is removed as images may be wrong compared with what the model's
    uncertainty says. Origin: 04cd1261."""
    # KNOWN_DB, KNOWN_DEG, CI95: By a model, an answer holds while 95 of 100 cases lie within these
    # limits of it.
    KNOWN_DB = 2.0
    """[dB] Origin: 7bd7faec."""
    KNOWN_DEG = 15.0
    """[deg] Origin: 7bd7faec."""
    # UNTRUSTED_SHARE, AROUND: What no model explains is shown to this share of the sample rate; its
    # misfit is a mean over so many lines to each side.
    UNTRUSTED_SHARE = 0.1
    """[ratio] Origin: d9add0c8 with benchmarks/tune_accuracy."""
    AROUND = 6
    """[count] Origin: d9add0c8 with benchmarks/tune_accuracy."""


class two_signals:
    """`response/two_signals.py`."""

    NOT_QUITE = 0.1
    """[ratio] Of what the two are folded differently by, so much may be wrong: a drive's speed is
    not quite a filter of first order. Origin: 04cd1261."""


class excitation:
    """`signals/excitation.py`."""

    OF_ODD = 4
    """[count] Of so many odd lines one is left empty, to show odd distortion. Origin:
    tests/unit/analysis/test_analysis_distortion.py."""


class line_spectra:
    """`signals/line_spectra.py`."""

    # TELLING, LATEST_S: The lag of the speed is read below this share of the sample rate, and is no
    # longer than this.
    TELLING = 0.2
    """[ratio] Origin: d9add0c8 with benchmarks/tune_accuracy."""
    LATEST_S = 2e-3
    """[s] Origin: d9add0c8 with benchmarks/tune_accuracy."""
    FINER = 4
    """[count] Points between samples at which the direction of motion is looked at. Origin:
    b256727a."""


class transient_removal:
    """`signals/transient_removal.py`."""

    # MOST, ABOVE: At most so many swings; each must stand so far above what lies around it (power).
    MOST = 5
    """[count] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    ABOVE = 40.0
    """[ratio] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    # NEAR, AROUND: Bins around a peak that are looked at, and around which its surroundings are
    # judged.
    NEAR = 5
    """[count] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    AROUND = 15
    """[count] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    # GONE, STEADY: A swing that is gone within a period spoils nothing; one that does not decay is
    # none.
    GONE = 0.02
    """[ratio] Origin: 06d2dd3d with benchmarks/analysis_speed."""
    STEADY = 0.97
    """[ratio] Origin: 06d2dd3d with benchmarks/analysis_speed."""


class ring_down:
    """`signals/ring_down.py`."""

    FEWEST_PERIODS = 3
    """[count] The sinusoid goes through so many periods within what was recorded, so that the
    parabola cannot stand for it. Origin: docs/slow-vibration.md."""
    FEWEST_SAMPLES = 40
    """[count] Fewer samples show no mode. Origin: docs/slow-vibration.md."""
    GRID_STEP = 0.03
    """[ratio] Frequencies are tried first in these steps; the search refines the best of them.
    Origin: docs/slow-vibration.md."""
    DAMPINGS = (0.003, 0.02, 0.08, 0.2)
    """[ratio] Damping ratios that are tried first. Origin: docs/slow-vibration.md."""
    DAMPING_ENDS = (0.0005, 0.4)
    """[ratio] Damping ratios between which a mode is looked for: a faster decay is no vibration.
    Origin: docs/slow-vibration.md."""
    OVERSAMPLING = 8
    """[ratio] Samples per period of the highest frequency that are kept for the fit. Origin:
    docs/slow-vibration.md."""
    CORRELATED_MOST = 0.98
    """[ratio] Correlation of neighbouring residuals beyond which samples do not count for less.
    Origin: docs/slow-vibration.md."""
    SMOOTHED = 0.1
    """[ratio] Mean over this share of a period, against the noise of one sample. Origin:
    docs/slow-vibration.md."""
    EDGE = 0.02
    """[ratio] A frequency this near to the end of what was looked at is none that was found.
    Origin: docs/slow-vibration.md."""
    CLEAR = 3.0
    """[ratio] The vibration begins at so many times what else is in the signal. Origin:
    docs/slow-vibration.md."""
    RINGS = 0.25
    """[ratio] A mode with more damping than this is gone within a period and is no vibration: it
    falls by 80 % in one. Origin: docs/slow-vibration.md."""
    EXPLAINED = 0.5
    """[ratio] A ring-down is this share the mode at least, by power. Origin:
    docs/slow-vibration.md."""
    AGREEING = 0.75
    """[ratio] So many of the moves show the mode, or it is not seen. Origin:
    docs/slow-vibration.md."""
    SCATTER = 0.15
    """[ratio] Deviation of the frequencies between moves beyond which they are not one mode.
    Origin: docs/slow-vibration.md."""


class sinusoids:
    """`vibration/sinusoids.py`."""

    MOST = 24
    """[count] Sinusoids that are looked for in one recording. Origin: docs/vibration.md."""
    STANDS_OUT = 18.0
    """[ratio] Power over the noise around a line from which on it is a sinusoid: of white noise one
    line in 10^7 is so high. Origin: docs/vibration.md."""
    AROUND = 61
    """[count] Lines, half a line apart, whose median is the noise. Origin: docs/vibration.md."""
    TOGETHER = 2
    """[count] So often the frequencies of all sinusoids are improved together. Origin:
    docs/vibration.md."""
    APART = 0.6
    """[ratio] Of a line: two sinusoids that are closer cannot be distinguished. Origin:
    docs/vibration.md."""


class orders:
    """`vibration/orders.py`."""

    # SPEEDS, SPAN: An order or a frequency is stated that so many speeds show, whose fastest is so
    # many times the slowest.
    SPEEDS = 3
    """[count] Origin: docs/vibration.md."""
    SPAN = 1.15
    """[ratio] Origin: docs/vibration.md."""
    # DEVIATIONS, OF_LINE: So far from the others, in standard deviations and of a line, a sinusoid
    # still belongs to them.
    DEVIATIONS = 3.0
    """[ratio] Origin: docs/vibration.md."""
    OF_LINE = 0.1
    """[ratio] Origin: docs/vibration.md."""
    PERIODS = 3.0
    """[count] Periods of a component that a speed has to hold. Origin: docs/vibration.md."""
    APART = 1.0
    """[ratio] Of a line: components that are closer have no levels of their own. Origin:
    docs/vibration.md."""


class level_peak:
    """`vibration/level_peak.py`."""

    MOST = 8
    """[count] Frequencies at which a mode is looked for. Origin: docs/vibration.md."""
    SCATTER = 0.03
    """[ratio] A level is not known better than this, whatever the noise. Origin:
    docs/vibration.md."""
    REACH = 1.3
    """[ratio] The oscillator describes the levels this far to both sides. Origin:
    docs/vibration.md."""
    STEP = 0.02
    """[ratio] Step of the frequencies that are tried, as a logarithm. Origin: docs/vibration.md."""
    # ZEROS, ZERO_REACH, START: The zero of a mode is looked for from these shares of its frequency
    # on, so far as a logarithm; the damping of both begins with this.
    ZEROS = (0.72, 0.86, 0.95)
    """[ratio] Origin: docs/vibration.md."""
    ZERO_REACH = 0.69
    """[ratio] Origin: docs/vibration.md."""
    START = 0.05
    """[ratio] Origin: docs/vibration.md."""
    WIDER = 1.2
    """[ratio] Linearised intervals held 91 in 100 of 177 modes; so much wider they hold 95. Origin:
    docs/vibration.md."""
    # SPARE, EACH_SIDE: Points beyond what is fitted, and points on each side of the frequency.
    SPARE = 3
    """[count] Origin: docs/vibration.md."""
    EACH_SIDE = 2
    """[count] Origin: docs/vibration.md."""
    CHANCE = 1e-4
    """[ratio] Chance of a peak where there is none, at one frequency. Origin: docs/vibration.md."""
    # DAMPINGS, DAMPING_STEPS: Damping ratios that are tried, and how many at first.
    DAMPINGS = (0.004, 0.3)
    """[ratio] Origin: docs/vibration.md."""
    DAMPING_STEPS = 6
    """[count] Origin: docs/vibration.md."""
    BROAD = 0.2
    """[ratio] From this damping on a hump is no resonance; a speed loop makes such ones. Origin:
    docs/vibration.md."""
    HEIGHT = 2.0
    """[ratio] A resonance is so high over the levels about it. Origin: docs/vibration.md."""
    MATTERS = 0.3
    """[ratio] An order whose levels are below this share of the highest one about a frequency is
    left out there. Origin: docs/vibration.md."""
    # ON_PEAK, ON_PEAK_POINTS, FALLS: So many points lie within so many dampings of the frequency,
    # and an order falls by this on both sides.
    ON_PEAK = 3.5
    """[ratio] Origin: docs/vibration.md."""
    ON_PEAK_POINTS = 3
    """[count] Origin: docs/vibration.md."""
    FALLS = 1.5
    """[ratio] Origin: docs/vibration.md."""


class dwell:
    """`vibration/dwell.py`."""

    # PERIODS, BLOCK_S, BLOCKS: A block holds so many periods and lasts so long at least; most of
    # them.
    PERIODS = 4
    """[count] Origin: docs/vibration.md."""
    BLOCK_S = 0.2
    """[s] Origin: docs/vibration.md."""
    BLOCKS = 40
    """[count] Origin: docs/vibration.md."""
    ARRIVED = 0.6
    """[ratio] A block of which less arrived is not used. Origin: docs/vibration.md."""
    TREND = 5
    """[count] Degree of the polynomial that slow motion is within a block. Origin:
    docs/vibration.md."""
    ALIKE = 0.9
    """[ratio] Highest correlation of neighbouring blocks that widens an interval. Origin:
    docs/vibration.md."""


class coupled_response:
    """`coupled/response.py`."""

    PERIODS = 2
    """[count] Whole periods that each experiment needs for a covariance. Origin:
    tests/unit/analysis/test_coupled_axes.py."""
    SHIFTED = 0.004
    """[ratio] No line is known better than a shift of its frequency by this makes of it, as no mode
    is (two deviations of KNOWN_HZ). Origin: tests/virtual/tools/test_gantry.py."""
    FLOOR = 0.005
    """[ratio] No entry is known better than this share of it. Origin:
    tests/virtual/tools/test_gantry.py."""
    REACH = 4
    """[count] Lines on each side over which the distortion is averaged: two realisations alone show
    it with four degrees of freedom a line. Origin: tests/unit/analysis/test_coupled_axes.py."""


class coupled_modes:
    """`coupled/modes.py`."""

    FEWEST_LINES = 12
    """[count] A model of one mode has ten parameters. Origin:
    tests/unit/analysis/test_coupled_axes.py."""
    MODES = 4
    """[count] No more modes are looked for. Origin: tests/unit/analysis/test_coupled_axes.py."""
    GAIN = 6.0
    """[ratio] Chi-square that a mode must take for each of its parameters (1 by chance, 2 by
    Akaike's criterion). Origin: tests/unit/analysis/test_coupled_axes.py."""
    FLOOR = 0.003
    """[ratio] No entry is known better than this share of its line, as filters of the feedback are
    taken as a delay. Origin: tests/unit/analysis/test_coupled_axes.py."""
    # VISCOUS_RAD_S, VISCOUS_RANGE: Corners of viscous friction from which the search begins, and
    # within which it stays.
    VISCOUS_RAD_S = (0.5, 10.0)
    """[rad/s] Origin: tests/unit/analysis/test_coupled_axes.py."""
    VISCOUS_RANGE = (1e-3, 300.0)
    """[rad/s] Origin: tests/unit/analysis/test_coupled_axes.py."""
    DELAY_RAD = 3.0
    """[rad] Most that the speed is reported later (or earlier) than the torque, as phase at the
    highest line. Origin: tests/unit/analysis/test_coupled_axes.py."""
    # DAMPING_RANGE, TRIED_DAMPING: Damping ratios that a mode may have, and the one that is tried
    # first at each place.
    DAMPING_RANGE = (5e-4, 0.7)
    """[ratio] Origin: tests/unit/analysis/test_coupled_axes.py."""
    TRIED_DAMPING = 0.03
    """[ratio] Origin: tests/unit/analysis/test_coupled_axes.py."""
    RIDGE = 1e-9
    """[ratio] Added to squares of 1 of the regression. Origin:
    tests/unit/analysis/test_coupled_axes.py."""
    APART = 0.06
    """[ratio] A mode that was found may be two, so far below and above it. Origin:
    tests/unit/analysis/test_coupled_axes.py."""
    STATIC = 0.01
    """[ratio] No stiffness at rest is known better than this (one deviation): it is concluded from
    modes above it whose damping is taken as proportional. Origin:
    tests/unit/analysis/test_coupled_axes.py."""
    # KNOWN_HZ, KNOWN_DAMPING: No frequency and no damping of a mode is known better than this (one
    # deviation of its logarithm): what is left of images and filters is no noise.
    KNOWN_HZ = 0.002
    """[ratio] Virtual drives at 1 kHz were off by up to 0.25 %. Origin:
    tests/virtual/tools/test_gantry.py."""
    KNOWN_DAMPING = 0.06
    """[ratio] Virtual drives at 1 kHz were off by up to 8 %. Origin:
    tests/virtual/tools/test_gantry.py."""
    DAMPING_KNOWN = 10.0
    """[ratio] A mode whose damping may differ by more from one end of its interval to the other is
    an outlier of one line. Origin: tests/unit/analysis/test_coupled_axes.py."""
    # PLACES, STARTS, EVALUATIONS: Frequencies at which one more mode is tried, the best ones that
    # are searched from, and the evaluations of each search.
    PLACES = 60
    """[count] Origin: tests/unit/analysis/test_coupled_axes.py."""
    STARTS = 2
    """[count] Origin: tests/unit/analysis/test_coupled_axes.py."""
    EVALUATIONS = 60
    """[count] Origin: tests/unit/analysis/test_coupled_axes.py."""
    RIGID_SHARE = 0.1
    """[ratio] A rigid body that the differential torque moves by less than this share of what the
    common torque does is none: the difference of the positions has a stiffness. Origin:
    tests/unit/analysis/test_coupled_axes.py."""


class coupled_stability:
    """`coupled/stability.py`."""

    COUPLED = 0.1
    """[ratio] No line above this share of a rigid body's coupling: two machines, or two joined so
    softly that the measured band does not show it. Origin:
    tests/unit/analysis/test_coupled_axes.py."""
    OPEN = 0.8
    """[ratio] A locus that is larger at the highest line may turn round -1 above it. Origin:
    tests/unit/analysis/test_coupled_axes.py."""
    # FACTORS, STEPS: Common factors of both speed gains that are tried, and how many.
    FACTORS = (0.05, 6.0)
    """[ratio] Origin: tests/unit/analysis/test_coupled_axes.py."""
    STEPS = 80
    """[count] Origin: tests/unit/analysis/test_coupled_axes.py."""


class duty_heat:
    """`duty/heat.py`."""

    WINDING = (0.15, 0.3, 0.5)
    """[ratio] Share of the rated temperature rise between winding and housing: low, usual, high.
    Origin: 67963fe4."""
    WINDING_S = (10.0, 60.0)
    """[s] Range of the time constant of the winding against the housing. Origin: 67963fe4."""
    WINDING_SHARE = (0.02, 0.1)
    """[ratio] The same as a share of the motor's time constant. Origin: 67963fe4."""
    SPEED_SHARE = (0.0, 0.35)
    """[ratio] Range of the share of the rated losses that depends on the speed alone. Origin:
    67963fe4."""
    SPEED_POWER = (1.0, 2.0)
    """[count] Range of the exponent of the speed in these losses. Origin: 67963fe4."""
    STATED = 0.15
    """[ratio] Relative error of that share where the torque at standstill is stated. Origin:
    67963fe4."""
    SATURATION = (0.0, 0.07)
    """[ratio] Range of the current in excess of torque at three times rated torque, per unit of
    torque above the rated one. Origin: 67963fe4."""
    COPPER = (0.0, 0.35)
    """[ratio] Range of the rise of the copper's resistance: 0.39 %/K at 20 °C, relative to the hot
    resistance, per rated rise of 60 to 125 K. Origin: 67963fe4."""
    TIME_CONSTANT = (0.75, 1.3)
    """[ratio] Range of the time constant: the catalogue's value holds for a motor on some flange.
    Origin: 67963fe4."""
    LONGEST = 12.0
    """[count] Longest time that is searched for the trip, in time constants. Origin: 67963fe4."""
    MOMENTS = 400
    """[count] Moments at which the temperature is computed in that search. Origin: 67963fe4."""


class duty_load:
    """`duty/load.py`."""

    GAP_FACTOR = 5.0
    """[ratio] An interval is a gap if it is longer than this many usual ones, and than `GAP_S`.
    Origin: 67963fe4."""
    GAP_S = 0.25
    """[s] See `GAP_FACTOR`. Origin: 67963fe4."""
    REPEATS = 0.8
    """[ratio] A period counts if the correlation of the signals one period apart is at least this.
    Origin: 67963fe4."""
    NEARLY = 0.97
    """[ratio] A period is preferred to its multiple if its correlation is at least this share of
    the best one. Origin: 67963fe4."""
    FALLEN = 0.5
    """[ratio] The correlation must have fallen below this before a period is searched. Origin:
    67963fe4."""
    MOST_SAMPLES = 65536
    """[count] Samples over which a period is searched at most. Origin: 67963fe4."""
