"""Thresholds of the tools: every number that was chosen and not derived, in one table.

One namespace for each module, which imports it as ``threshold``. Behind each number stands its
unit in brackets ("ratio" and "count" have none), what it decides, and its origin: the commit that
set it, with the benchmark or page of figures that the commit changed, where it changed one.
`python -m benchmarks.thresholds` halves and doubles the numbers of the analysis; what half and
twice of those here do was not measured, as each case would need a whole tool on a virtual drive.
Numbers that follow from a definition (bits of a status word, the range of an object) stand in
their modules.
"""

from __future__ import annotations


class autotune_again:
    """`tuning/autotune/again.py`."""

    # WIDTH, DB, DEG: A prediction stands within these: share of the -3 dB point, dB and degrees.
    # The aims are 10 %, 3 dB and 6° (tuning.md, section 5).
    WIDTH = 0.08
    """[ratio] Origin: 5caa8367."""
    DB = 3.0
    """[dB] Origin: 5caa8367."""
    DEG = 6.0
    """[deg] Origin: 5caa8367."""
    SAME = 0.02
    """[ratio] Gains that differ by less are the same. Origin: 5caa8367."""


class autotune_apply:
    """`tuning/autotune/apply.py`."""

    # SOFTENED, QUIETER: So often a candidate that oscillates is made softer, and to this share of
    # the hum that is permitted.
    SOFTENED = 2
    """[count] Origin: 33aa8ae7."""
    QUIETER = 0.85
    """[ratio] Origin: 33aa8ae7."""


class autotune_candidates:
    """`tuning/autotune/design/candidates.py`."""

    VERIFIABLE = 0.2
    """[ratio] A loop can be verified up to this share of the sample rate, so none is designed above
    it. Origin: e01bb3d6."""
    # SEEN, NARROWINGS: The -3 dB point must lie below this share; the highest gain is lowered so
    # many times for it.
    SEEN = 0.23
    """[ratio] Origin: 7166e5a3 with benchmarks/tune_accuracy."""
    NARROWINGS = 4
    """[count] Origin: 7166e5a3 with benchmarks/tune_accuracy."""
    COHERENT = 0.8
    """[ratio] Lines that a cautious design trusts. Origin: 66bd184e with
    benchmarks/tune_accuracy."""


class autotune_gain_steps:
    """`tuning/autotune/verification/gain_steps.py`."""

    STEP_DB = 2.5
    """[dB] Gains are raised in steps of this many dB, and the last one to what is asked for.
    Origin: 17b160fe."""
    SURE_STEP_DB = 5.0
    """[dB] The same up to a gain with which every possible loop is stable. Origin:
    benchmarks/rough_campaign."""
    # QUIET_PERCENT, NOISE: Torque of a steady part, root mean square in % of the rated: this is
    # quiet, and noise may rise by the gain and this factor.
    QUIET_PERCENT = 1.5
    """[%] Origin: 17b160fe."""
    NOISE = 2.5
    """[ratio] Origin: 17b160fe."""
    GROWS = 1.5
    """[ratio] An oscillation that grows by this from one half of a steady part to the other is an
    onset. Origin: 17b160fe."""
    # PIECES, DECAYS: A steady part is seen in so many pieces; a band whose power falls by this from
    # each one to the next decays, as what a step leaves does in a loop that is stable (3 dB over
    # the whole part).
    PIECES = 3
    """[count] Origin: d16e3511."""
    FEW = 8
    """[count] Fewer samples than this in a piece show no bands. Origin: d16e3511."""
    BACK = 0.25
    """[ratio] Steps begin again where they began to this share of their way: torque that depends on
    the position is the same there. Origin: benchmarks/rough_campaign."""
    RECEIVED = 0.9
    """[ratio] Share of the samples of a steady part without which nothing is concluded from it:
    a gap of 12 ms may hide an oscillation. Origin: test_gain_steps_lost.py."""
    FALSE_ALARM = 1e-3
    """[ratio] Noise passes for growth in one of so many steps at most, over all bands of a spectrum
    together. Origin: d16e3511."""
    # DEGREES, DEGREES_BEFORE: Real degrees of freedom of a band of three lines in one piece, and of
    # the noise next to it in all pieces of the step with the gain as it is: each line of a Hann
    # window shares with its neighbours.
    DEGREES = 3.0
    """[deg] Origin: d16e3511."""
    DEGREES_BEFORE = 9.0
    """[deg] Origin: d16e3511."""


class autotune_gains:
    """`tuning/autotune/design/gains.py`."""

    # WIDENINGS, SHORTEST_S: Filters are widened in so many steps: a torque filter to half its time,
    # a speed filter by √2; no torque filter is made shorter than this.
    WIDENINGS = 3
    """[count] Origin: 66bd184e with benchmarks/tune_accuracy."""
    SHORTEST_S = 0.1e-3
    """[s] Origin: 66bd184e with benchmarks/tune_accuracy."""
    MORE = 1.05
    """[ratio] By so much a gain may exceed its design where a raw value is rounded: 0.4 dB of the
    1.5 dB that a design has in reserve. Origin: test_loop_gains.py."""
    LOOP_PERIOD_S = 50e-6
    """[s] Loop period of the drives: half of it to compute, half of it until the torque's mean
    follows. Origin: e01bb3d6."""


class autotune_notches:
    """`tuning/autotune/design/notches.py`."""

    RISES_DB = 6.0
    """[dB] A resonance that rises by less bounds no gain. Origin: 97ed310d."""
    FREE = 0.7
    """[ratio] Without a loop learning takes this share of the time: no trial for its size, one
    period less. Origin: 76c87fed with docs/tuning-accuracy.md."""


class autotune_present:
    """`tuning/autotune/present.py`."""

    SLOWER = 0.9
    """[ratio] A design whose speed gain is this much below what the axis has is slower. Origin:
    e15b4fe3 with docs/tuning-accuracy.md."""


class autotune_raising:
    """`tuning/autotune/verification/raising.py`."""

    # NOT_SHOWN_DB, MOST_SHOWN_DB: So much of a guaranteed gain margin is shown by raising the gain,
    # where the last crossover is above what was measured: all but this, and no more than that.
    NOT_SHOWN_DB = 1.5
    """[dB] Origin: 17b160fe."""
    MOST_SHOWN_DB = 7.0
    """[dB] Origin: 17b160fe."""
    # SURELY_DB, AT_ONCE_DB, LEAST_LEFT_DB: A gain is raised by this beyond what excludes a loop, as
    # a parameter has steps; and where that is more than what must be shown and this, it leaves so
    # much of the gain margin of the design: the amplified noise of a loop with 1 dB is no onset.
    SURELY_DB = 0.2
    """[dB] Origin: d16e3511."""
    AT_ONCE_DB = 0.5
    """[dB] Origin: d16e3511."""
    MOST_DB = 20.0
    """[dB] Nothing is raised further: eight steps, each of two to three seconds. Origin:
    benchmarks/rough_campaign."""
    LEAST_LEFT_DB = 1.0
    """[dB] Origin: benchmarks/rough_campaign; autotune_gain_steps.NOISE."""
    KEPT_BACK_DB = 2.5
    """[dB] A raise is sure to end before an onset where every possible loop has so much more gain
    margin. Origin: d16e3511."""
    # SOFTER, SOFTER_STEPS: Where no raise shows the margins of a design, shares of its gains are
    # tried, each this much of the one before.
    SOFTER = 0.92
    """[ratio] Origin: benchmarks/rough_campaign."""
    SOFTER_STEPS = 12
    """[count] Down to 0.37 of the gains. Origin: benchmarks/rough_campaign."""


class autotune_reference:
    """`tuning/autotune/verification/reference.py`."""

    LOWEST_HZ = 5.0
    """[Hz] Lowest line of a loop's response. Origin: 66bd184e."""
    CORNERS_HZ = (40.0, 80.0, 160.0, 320.0, 640.0)
    """[Hz] Corners that a reference is tried with; the first one is the usual. Origin:
    benchmarks/rough_campaign."""
    # CREST, CREST_SENT: Peak over root mean square of a sum of many lines with any phases, and of
    # the reference itself, whose phases are chosen for a low one.
    CREST = 3.5
    """[ratio] Origin: benchmarks/rough_campaign."""
    CREST_SENT = 1.7
    """[ratio] Origin: benchmarks/rough_campaign."""
    TORQUE_SHARE = 0.35
    """[ratio] Peak of the predicted torque, of the permitted one: as the excitation that measured
    the mechanics (`SweepSettings.share`). Origin: benchmarks/rough_campaign."""
    # SPEED_SHARE, SPEED_RAD_S: Peak of the predicted speed, as that of the usual reference.
    SPEED_SHARE = 0.15
    """[ratio] Origin: 66bd184e."""
    SPEED_RAD_S = 8.0
    """[rad/s] Origin: 66bd184e."""
    REFERENCE_SHARE = 0.3
    """[ratio] Peak of the reference, of the permitted speed: next to the base motion a loop that
    follows it better than predicted stays within the envelope. Origin:
    benchmarks/rough_campaign."""
    AS_LARGE = 0.9
    """[ratio] No line is smaller than this share of the usual one. Origin:
    benchmarks/rough_campaign."""
    WORTH = 1.5
    """[ratio] Lines at the last crossover must be so much larger. Origin:
    benchmarks/rough_campaign."""


class autotune_run:
    """`tuning/autotune/run.py`."""

    SATURATED = 0.25
    """[ratio] A response with more of its samples at a torque limit is none. Origin: 7166e5a3 with
    benchmarks/tune_accuracy."""
    # SOFT_HZ, SOFT_ALONE_HZ: Gains that hardly any axis oscillates with, for measuring one that
    # does with its own. With the inertia that the drive holds, and with that of the motor alone.
    SOFT_HZ = 5.0
    """[Hz] Origin: 66bd184e with benchmarks/tune_accuracy."""
    SOFT_ALONE_HZ = 20.0
    """[Hz] Origin: 66bd184e with benchmarks/tune_accuracy."""


class autotune_time_budget:
    """`tuning/autotune/time_budget.py`."""

    AROUND_S = 4.0
    """[s] Writing a design, standing still and a step, next to the measurement of the loop. Origin:
    e3bffcb4 with benchmarks/tune_accuracy."""
    DESIGNED_AND_VERIFIED_S = 12.0
    """[s] What follows the measurements: computing designs, writing one and verifying it. Origin:
    76c87fed with docs/tuning-accuracy.md."""
    # GAIN_STEP_S, GAIN_STEPS, CROSSES_HZ: A step with a raised gain, how many of them a loop needs
    # that crosses above the measured band, and up to how many Hz tuned loops cross.
    GAIN_STEP_S = 2.1
    """[s] Origin: 7c9ae141."""
    GAIN_STEPS = 3
    """[count] Origin: 7c9ae141."""
    CROSSES_HZ = 400.0
    """[Hz] Origin: 7c9ae141."""
    LOST_S = 6.0
    """[s] What a verification takes longer at most where samples are lost all the time. Origin:
    76c87fed with docs/tuning-accuracy.md."""
    SWEEP_S = 16.0
    """[s] A frequency response, as far as it must be. Origin: 76c87fed with
    docs/tuning-accuracy.md."""


class autotune_verdict:
    """`tuning/autotune/verification/verdict.py`."""

    # MARGIN_DB, MARGIN_DEG, MS_RATIO: What a measured margin is known to; the designs keep more
    # than this in reserve.
    MARGIN_DB = 1.0
    """[dB] Origin: 66bd184e with benchmarks/tune_accuracy."""
    MARGIN_DEG = 1.0
    """[deg] Origin: 66bd184e with benchmarks/tune_accuracy."""
    MS_RATIO = 1.03
    """[ratio] Origin: 66bd184e with benchmarks/tune_accuracy."""
    # COHERENT, BLURRED_DEG, LINES: Lines that margins are read from: coherence, standard deviation
    # of the phase, how many at least.
    COHERENT = 0.9
    """[ratio] Origin: 17b160fe."""
    BLURRED_DEG = 4.0
    """[deg] Origin: 17b160fe."""
    LINES = 12
    """[count] Origin: 17b160fe."""
    SHOWN_DEG = 20.0
    """[deg] Up to this standard deviation a line counts, by its weight, for the delay and the gain
    of a loop, which all lines share: its logarithm is still linear in its error. Origin:
    benchmarks/rough_campaign."""
    # COMMON_LATE_S, COMMON_SIZE: What all lines of such a loop may be off by together, one
    # deviation: on two axes whose loops are as predicted the delay was found 80 µs too short.
    COMMON_LATE_S = 40e-6
    """[s] Origin: benchmarks/rough_campaign."""
    COMMON_SIZE = 0.03
    """[log] Origin: benchmarks/rough_campaign."""
    GAP = 1.5
    """[ratio] The measured band ends where the next line is farther than this factor away. Origin:
    17b160fe."""


class autotune_verify:
    """`tuning/autotune/verification/verify.py`."""

    SEEN = 0.8
    """[ratio] Coherence of lines that a bandwidth is read from where those do not hold it. Origin:
    29633e14."""
    MOST_PAIRS = 4
    """[count] Pairs of realisations that are measured at most where the first one shows too little:
    friction and noise of a heavy or a coarse axis average out, and so does the distortion of play,
    which a single pair cannot distinguish from the response. Origin: 5caa8367."""
    LOOKS = 2
    """[count] A loop that contradicts its prediction is verified once more where there is time for
    so many: that one, and a more careful design. Origin: 5caa8367."""
    # USUAL_STEP_RPM, WORTH_A_STEP: A step, unless noise asks for a larger one, which is made where
    # it is this much larger.
    USUAL_STEP_RPM = 100.0
    """[rpm] Origin: ed1a5f9a with benchmarks/rough_campaign."""
    WORTH_A_STEP = 1.2
    """[ratio] Origin: ed1a5f9a with benchmarks/rough_campaign."""
    RAISED_TORQUE = 0.8
    """[ratio] Largest torque expected of a step with a raised gain, of the permitted one. Origin:
    benchmarks/rough_campaign."""
    OVERSHOOT_PERCENT = 40.0
    """[%] Where there are fewer, a step may overshoot by this. Origin: 691daa5e with
    docs/tuning-accuracy.md."""
    # AS_PREDICTED, DOUBTED: A bandwidth this near to the predicted one is as predicted; one that is
    # measured once more is less far away, as a single pair of realisations may be off to either
    # side.
    AS_PREDICTED = 0.1
    """[ratio] Origin: 5caa8367."""
    DOUBTED = 0.08
    """[ratio] Origin: 5caa8367."""
    SURELY_HUMS = 2.0
    """[ratio] A dozen readings at standstill with so many times the torque of a hum are one: by
    chance they are 1.5 times theirs in one of a hundred. Origin: chi-square of ten degrees of
    freedom."""
    HUM_PERCENT = 4.0
    """[%] Torque of a standing axis, root mean square in % of rated torque, that is a hum. Origin:
    33aa8ae7."""


class brake_evaluate:
    """`mechanics/brake/evaluate.py`."""

    PRELOAD = 0.1
    """[ratio] Share of the test torque that takes up play before travel counts. Origin:
    ca58f5df."""
    # DEVIATIONS, OF_LIMIT: A departure from the elastic line by so many deviations of the position,
    # and by this share of the slip limit, is slip.
    DEVIATIONS = 6.0
    """[ratio] Origin: ca58f5df."""
    OF_LIMIT = 0.05
    """[ratio] Origin: ca58f5df."""
    # PARTS, STIFF_QUANTILE: Parts of the ramp that a compliance is calculated from; a slipping part
    # is softer than an elastic one.
    PARTS = 8
    """[count] Origin: ca58f5df."""
    STIFF_QUANTILE = 0.3
    """[ratio] Origin: ca58f5df."""
    ONSET_S = 0.005
    """[s] Time before a motion that still belongs to it. Origin: ca58f5df."""
    SHARE = 0.005
    """[ratio] Torque is not known better than this share of it, whatever the scatter. Origin:
    16e1fbc9."""
    GONE = 0.2
    """[ratio] Below this share of what it was the torque counts as gone. Origin: ca58f5df."""
    SHORT = 0.95
    """[ratio] Share of the test torque below which a brake was not tested with it. Origin:
    ca58f5df."""


class brake_texts:
    """`mechanics/brake/texts.py`."""

    CREPT = 0.05
    """[ratio] Slip below this share of the limit is what an encoder and a settling hub show.
    Origin: ca58f5df."""


class brake_run:
    """`mechanics/brake/run.py`."""

    # LEAD_S, PRELOAD_S, STILL_S, TOP_S, DOWN_S, END_S: Seconds of each part of the sequence next to
    # its ramp.
    LEAD_S = 0.2
    """[s] Origin: ca58f5df."""
    PRELOAD_S = 0.15
    """[s] Origin: ca58f5df."""
    STILL_S = 0.15
    """[s] Origin: ca58f5df."""
    TOP_S = 0.25
    """[s] Origin: ca58f5df."""
    DOWN_S = 0.25
    """[s] Origin: ca58f5df."""
    END_S = 0.05
    """[s] Origin: ca58f5df."""
    # ABOVE_SHARE, ABOVE_PERCENT: The envelope watches the actual torque, which swings about what is
    # sent.
    ABOVE_SHARE = 1.08
    """[ratio] Origin: ca58f5df."""
    ABOVE_PERCENT = 3.0
    """[%] Origin: ca58f5df."""
    AFTER_HALT_S = 0.1
    """[s] After a halt the loop goes on telling what happens; the torque is gone within that.
    Origin: ca58f5df."""
    RAN_ON_REV = 0.05
    """[rev] A shaft that runs so far beyond its limit is not stopped by its brake, and the other
    direction is not tested. A worn brake ends within 0.01 rev, a lost one lets it coast 0.3 to 0.5
    rev. Origin: 28 November 2026, `tests/virtual/tools/test_brake_test.py`."""


class first_power_evaluate:
    """`mechanics/first_power/evaluate.py`."""

    GOAL = 0.85
    """[ratio] Share of the permitted travel that the shaft is to go each way. Origin: 8b39c64c."""
    STILL_REV = 5e-4
    """[rev] Below this [rev] a pulse has moved nothing; an encoder and a twisting coupling show so
    much. Origin: 8b39c64c."""
    SOME = 0.02
    """[ratio] Less than this share of the goal is no way at all. Origin: 8b39c64c."""
    HAND = 0.05
    """[ratio] A person meets a mark within 18° of a revolution. Origin: 8b39c64c."""
    LEAST_V = 10.0
    """[V] At less DC voltage than this no drive that is served here works. Origin: 8b39c64c."""


class first_power_run:
    """`mechanics/first_power/run.py`."""

    # PULSE_S, LEAD_S, AFTER_S, RAMP_S: Seconds of a pulse, and of no torque before and after it.
    PULSE_S = 0.03
    """[s] Origin: eb4cafeb."""
    LEAD_S = 0.01
    """[s] Origin: eb4cafeb."""
    AFTER_S = 0.06
    """[s] Origin: eb4cafeb."""
    RAMP_S = 0.004
    """[s] Origin: eb4cafeb."""
    # STRONGER, FIRST_PERCENT: Each pulse that moves less is followed by one that is stronger by
    # this.
    STRONGER = 1.35
    """[ratio] Origin: eb4cafeb."""
    FIRST_PERCENT = 1.5
    """[%] Origin: eb4cafeb."""
    # SMALL_REV, LARGE_REV, WEAKER: A pulse that moves less than the first is made stronger, one
    # that moves more than the second weaker, by the third.
    SMALL_REV = 0.003
    """[rev] Origin: 8b39c64c."""
    LARGE_REV = 0.01
    """[rev] Origin: 8b39c64c."""
    WEAKER = 1.5
    """[ratio] Origin: 8b39c64c."""
    CUT_REV = 0.012
    """[rev] A pulse that has moved the shaft so far is over: what is left is what it coasts.
    Origin: 8b39c64c."""
    CUT_RPM = 30.0
    """[rpm] The same for its speed: with break-away friction of 0.08 of rated torque, and hardly
    any at speed, a bare rotor of 25 000 rad/s² at rated torque still coasts less than 0.1 rev.
    Origin: 28 November 2026, `tests/virtual/tools/test_first_power.py`."""
    MOST_PULSES = 60
    """[count] Most pulses of one check. Origin: 8b39c64c."""
    # SETTLES_S, SETTLE_LOOK_S: Longest wait for standstill after a pulse, and how often the
    # position is read meanwhile.
    SETTLES_S = 1.0
    """[s] Origin: 8b39c64c."""
    SETTLE_LOOK_S = 0.05
    """[s] Origin: 8b39c64c."""
    # HAND_STILL_S, HAND_POLL_S: A shaft that a person turned counts as at its mark after so long
    # without motion.
    HAND_STILL_S = 2.0
    """[s] Origin: 8b39c64c."""
    HAND_POLL_S = 0.05
    """[s] Origin: 8b39c64c."""
    HAND_LEAST = 0.2
    """[ratio] Least turn by hand that shows resolution and direction, in rev. Origin: 8b39c64c."""


class friction_evaluate:
    """`mechanics/friction/evaluate.py`."""

    # BLOCKS, EVEN: Blocks that a mean is calculated over; a speed that is not held in one of them
    # is uneven.
    BLOCKS = 8
    """[count] Origin: 16e1fbc9."""
    EVEN = (0.3, 1.7)
    """[ratio] Origin: 16e1fbc9."""
    # ARRIVED, NEARLY: A plateau of which less arrived is not used. What a revolution may lack to be
    # one.
    ARRIVED = 0.8
    """[ratio] Origin: 16e1fbc9."""
    NEARLY = 0.03
    """[ratio] Origin: 16e1fbc9."""
    FOLLOWED_HZ = 25.0
    """[Hz] The speed loop's torque shows ripple up to this frequency. Origin: 16e1fbc9."""
    # STANDS_OUT, OF_STEP: An order stands out so many deviations above the others; and this share
    # of 6077h's step.
    STANDS_OUT = 4.5
    """[ratio] Origin: 16e1fbc9."""
    OF_STEP = 0.25
    """[ratio] Origin: 16e1fbc9."""
    BINS = 360
    """[count] Places of a revolution that torque is averaged over. Origin: 16e1fbc9."""
    SHARE = 0.005
    """[ratio] Torque is not known better than this share of it, whatever the scatter. Origin:
    16e1fbc9."""
    SHARE_OF_RIPPLE = 0.03
    """[ratio] Nor an order of the ripple better than this, with the roughly known inertia and
    friction that are removed: one run of each of the five families was off by 2 to 4 %. Origin:
    d16e3511."""


class friction_run:
    """`mechanics/friction/run.py`."""

    # LEAST_S, LONGEST_S: A plateau lasts so long at least, and no longer for the sake of a whole
    # revolution.
    LEAST_S = 0.3
    """[s] Origin: 16e1fbc9."""
    LONGEST_S = 4.0
    """[s] Origin: 16e1fbc9."""
    SLOW_S = (3.0, 2.0, 1.2)
    """[s] Plateaus too slow for a whole revolution, in order of preference. Origin: 16e1fbc9."""
    SHORT_S = 0.15
    """[s] Without a whole revolution (short travel) a plateau lasts at least this long. Origin:
    16e1fbc9."""
    SLOWEST_RPM = 2.0
    """[rpm] Slowest plateau, where the settings name none. Origin: 16e1fbc9."""
    # RIPPLE_REV, RIPPLE_SHARE, RIPPLE_HZ: The ripple's revolution: with some more on both sides, in
    # this share of the time, at no more than this frequency of its highest order.
    RIPPLE_REV = 1.25
    """[rev] Origin: 16e1fbc9."""
    RIPPLE_SHARE = 0.25
    """[ratio] Origin: 16e1fbc9."""
    RIPPLE_HZ = 25.0
    """[Hz] Origin: 16e1fbc9."""
    ALIKE = 0.15
    """[ratio] Plateaus closer than this to the speed of the ripple measurement are left out.
    Origin: 16e1fbc9."""


class health_evaluate:
    """`watching/health/evaluate.py`."""

    FOLLOWED = 3
    """[count] So many of a kind are followed, the lowest ones: they are the stiffness of the drive
    train. Origin: b68b54c1."""
    SAME_SPEED = 0.03
    """[ratio] Speeds of both directions belong together within this share. Origin: b68b54c1."""


class inertia_evaluation:
    """`mechanics/inertia/evaluation.py`."""

    CUTOFF_HZ = 25.0
    """[Hz] Corner of the smoothing of speed and torque before the regression. Origin: 66bd184e with
    benchmarks/tune_accuracy."""
    # EXPLAINED, SWING_HZ: Above this R² nothing is left to explain; below, the load may swing in
    # this range of Hz.
    EXPLAINED = 0.9995
    """[ratio] Origin: ba28e55a."""
    SWING_HZ = (4.0, 80.0)
    """[Hz] Origin: ba28e55a."""
    # LOOP_EXPLAINED, LOOP_LATEST: A speed loop whose gains explain this share of the torque is
    # seen; its torque follows its error by fewer than so many cycles.
    LOOP_EXPLAINED = 0.9
    """[ratio] Origin: test_inertia_sampled.py."""
    LOOP_LATEST = 6
    """[count] Origin: test_inertia_sampled.py."""


class inertia_moves:
    """`mechanics/inertia/moves.py`."""

    RAMP_S = 0.15
    """[s] A ramp shorter than this excites the machine's resonances more than its inertia. Origin:
    f0621549."""
    SMOOTHING_S = 0.03
    """[s] Rounding of the corners of a move's speed. Origin: f0621549."""
    FIRST_REV = 0.12
    """[rev] Way of the first move. Origin: f0621549."""
    FOLLOWED = 0.2
    """[ratio] A first move that gets less than this share of its way is made larger, while it takes
    little torque: a heavy load on a loop that was never tuned for it hardly follows. Origin:
    8d69615d."""
    FOLLOWS_WELL = 0.7
    """[ratio] Of less than this share of its way the loop is soft: it is helped by torque sent
    ahead of it. Origin: 8d69615d."""
    # WEAKER, ATTEMPTS: Moves that take more torque than is permitted become weaker by this factor,
    # so many times.
    WEAKER = 0.6
    """[ratio] Origin: 8d69615d."""
    ATTEMPTS = 3
    """[count] Origin: 8d69615d."""
    # EXPECTED, ROUGHLY: A move is made where its loop is expected to take this share of the
    # permitted torque at most, by an inertia that is known to so much; else torque is sent ahead,
    # and the move becomes weaker.
    EXPECTED = 0.8
    """[ratio] Origin: acfa9c65."""
    ROUGHLY = 0.1
    """[ratio] Origin: acfa9c65."""
    FRICTION_RAD_S = 0.5
    """[rad/s] Speed within which friction changes its sign in what a move is expected to take.
    Origin: 8d69615d."""
    # STOOD_REV, STOOD_SHARE, BRAKE_WAIT_S: An axis that moved less than this under too much torque
    # stood: a brake opens within this time.
    STOOD_REV = 0.005
    """[rev] Origin: 5528340d."""
    STOOD_SHARE = 0.02
    """[ratio] Origin: 5528340d."""
    BRAKE_WAIT_S = 1.0
    """[s] Origin: 5528340d."""
    BEGUN = 0.1
    """[ratio] Share of the first way at which a free axis has begun to move. A brake that opens
    later than that spoils the move, and the loop winds up against it at the beginning of every
    later one. Origin: d16e3511."""


class inertia_probe:
    """`mechanics/inertia/probe.py`."""

    DURATION_S = 0.28
    """[s] Length of one torque pulse pair. Origin: 76d84383."""
    ENOUGH_RAD_S = 6.0
    """[rad/s] The axis moves well above this speed, and well above what its sensor and filter blur.
    Origin: 76d84383."""
    FIRST_SHARE = 0.02
    """[ratio] Share of rated torque of the first pulse. Origin: 76d84383."""
    PULLED = 0.01
    """[ratio] A holding torque above this share of rated torque is a load that pulls. Origin:
    f0621549."""
    SETTLE_S = 0.3
    """[s] Dwell before the holding torque is read. Origin: f0621549."""
    READINGS = 12
    """[count] Readings of the holding torque. Origin: f0621549."""
    RESTLESS_PERCENT = 5.0
    """[%] Deviation of the holding torque (rated torque) from which an axis oscillates at
    standstill. Origin: f0621549."""
    RESTLESS_RPM = 3.0
    """[rpm] The same of its speed. Origin: f0621549."""
    FALLING_RPM = 30.0
    """[rpm] A load that sinks on the softest loop is slower than this long before it is looked at;
    one that nothing holds is faster within some hundredths of a second. Origin: 63dccfbe."""
    GAINED = 0.1
    """[ratio] Share of the energy moved to and fro that noise alone does not make. Origin: 7166e5a3
    with benchmarks/tune_accuracy."""
    # RIGID, AGAINST: A fitted inertia below this share of what the momentum of the pulse gives is
    # not that of a rigid body; below minus that share the body moves against its torque.
    # Simulated: 0.7 to 1 for rigid axes, down to -0.2 for 12 times the motor on a coupling of 2 to
    # 8 Hz.
    RIGID = 0.25
    """[ratio] Origin: test_probe_judged.py."""
    AGAINST = 0.5
    """[ratio] Origin: test_probe_judged.py."""
    SMOOTHED_S = 0.02
    """[s] A motion of some tenths of a second, a mean over so many seconds of which hides nothing.
    Origin: dc38bcd8."""
    # STOOD, BRAKE_S: Share of the wanted speed below which an axis stood, and how long a brake may
    # take to open after Operation enabled.
    STOOD = 0.05
    """[ratio] Origin: 5528340d."""
    BRAKE_S = 0.5
    """[s] Origin: 5528340d."""


class inertia_run:
    """`mechanics/inertia/run.py`."""

    END_MARGIN_REV = 0.15
    """[rev] Margin to a taught or found end. Origin: f0621549."""
    # GENTLY, AROUND_S: Gentle moves last about so many times as long; seconds next to them, such as
    # going back.
    GENTLY = 1.5
    """[ratio] Origin: 76c87fed with docs/tuning-accuracy.md."""
    AROUND_S = 2.0
    """[s] Origin: 76c87fed with docs/tuning-accuracy.md."""


class inertia_soft_loop:
    """`mechanics/inertia/soft_loop.py`."""

    EXPLAINED = 0.98
    """[ratio] Gains that explain less of the torque of a move (share of its variance) are not the
    loop's. Origin: acfa9c65."""
    LATEST = 6
    """[count] The loop's torque follows its error by so many cycles at most. Origin: acfa9c65."""


class jog_cyclic:
    """`moving/jog/cyclic.py`."""

    # RENEW_S, LOOK_S
    RENEW_S = 0.05
    """[s] Origin: d0b2ef4f."""
    LOOK_S = 0.02
    """[s] Origin: d0b2ef4f."""
    STATE_TIMEOUT_S = 5.0
    """[s] Longest wait for a change of the power state. Origin: 971882ae."""
    MAX_S = 120.0
    """[s] Longest jog. Origin: 971882ae."""
    PATIENCE = 10
    """[count] Cycles without a new sample that are tolerated. Origin: 5ae2f284."""


class jog_hold:
    """`moving/jog/hold.py`."""

    GAP_S = 0.2
    """[s] Longest time between signs of life before the axis brakes. Origin: d0b2ef4f."""
    RESUME_S = 0.5
    """[s] From the last sign before a gap to the one that ends it, at most. Origin: d0b2ef4f."""
    CONFIRM_S = 0.05
    """[s] Between the arrivals of two signs of life that end a gap, at least. Origin: d0b2ef4f."""


class jog_run:
    """`moving/jog/run.py`."""

    PERIOD_S = 0.04
    """[s] Period of target renewals to the drive (20 Hz or faster). Origin: a412d0d6."""
    TRAVEL_MARGIN_REV = 0.05
    """[rev] The axis may leave the travel limit by this much before the jog ends with an error.
    Origin: a412d0d6."""


class gantry_evaluate:
    """`tuning/gantry/evaluate.py`."""

    FIGHT_PERCENT = 10.0
    """[% of rated torque] Both sides of a gantry that press against each other with more are out of
    square: as much as friction of a sound axis takes. Origin:
    tests/virtual/tools/test_gantry.py."""
    TORQUE_PERCENT = 0.1
    """[% of rated torque] No mean torque is known better: the step of 6077h. Origin: CiA 402-2
    object 6077h."""
    # MS, PHASE_MARGIN_DEG: What the pair must keep at the far end of its intervals.
    MS = 2.0
    """[ratio] Origin:
    tests/virtual/tools/test_gantry.py."""
    PHASE_MARGIN_DEG = 30.0
    """[°] That of an Ms of 2. Origin:
    tests/virtual/tools/test_gantry.py."""
    DISTORTED = 4.0
    """[ratio] Variance between realisations over that of the noise, above which it is named.
    Origin:
    tests/virtual/tools/test_gantry.py."""


class gantry_run:
    """`tuning/gantry/run.py`."""

    # LOWEST_HZ, TOP, LINES: Band of the lines, the upper end as a share of the sample rate, and how
    # many lines there are.
    LOWEST_HZ = 4.0
    """[Hz] Origin:
    tests/virtual/tools/test_gantry.py."""
    TOP = 0.25
    """[ratio] Origin:
    tests/virtual/tools/test_gantry.py."""
    LINES = 70
    """[count] Origin:
    tests/virtual/tools/test_gantry.py."""
    CORNER_HZ = 40.0
    """[Hz] Amplitudes of the speed fall above this, as the torque for them rises. Origin:
    tests/virtual/tools/test_gantry.py."""
    PERIODS = 6
    """[count] Periods of each experiment that count. Origin:
    tests/virtual/tools/test_gantry.py."""
    REALISATIONS = 2
    """[count] Draws of the phases: one for each direction first. Origin:
    tests/virtual/tools/test_gantry.py."""
    RAMP_S = 0.4
    """[s] Into and out of the steady speed. Origin:
    tests/virtual/tools/test_gantry.py."""
    # USED, FAST: Share of travel and speed limit that is planned with.
    USED = 0.75
    """[ratio] Origin:
    tests/virtual/tools/test_gantry.py."""
    FAST = 0.8
    """[ratio] Origin:
    tests/virtual/tools/test_gantry.py."""
    EXCITED = 0.6
    """[ratio] Peak of the excitation over the steady speed: no motor may reverse. Origin:
    tests/virtual/tools/test_gantry.py."""
    LEAST_RPM = 3.0
    """[rpm] No slower steady speed: friction would stick. Origin:
    tests/virtual/tools/test_gantry.py."""
    # ATTEMPTS, WEAKER: So often everything is played where torque ends a motion, each time with
    # this share of the excitation.
    ATTEMPTS = 3
    """[count] Origin:
    tests/virtual/tools/test_gantry.py."""
    WEAKER = 0.5
    """[ratio] Origin:
    tests/virtual/tools/test_gantry.py."""
    # BACK, BACK_S, BACK_ATTEMPTS, NEAR_REV: Ways home: share of the speed limit, shortest time, how
    # many, and how near is enough.
    BACK = 0.25
    """[ratio] Origin:
    tests/virtual/tools/test_gantry.py."""
    BACK_S = 0.5
    """[s] Origin:
    tests/virtual/tools/test_gantry.py."""
    BACK_ATTEMPTS = 3
    """[count] Origin:
    tests/virtual/tools/test_gantry.py."""
    NEAR_REV = 0.002
    """[rev] Origin:
    tests/virtual/tools/test_gantry.py."""


class load_side_evaluate:
    """`mechanics/load_side/evaluate.py`."""

    CATALOGUE = 0.05
    """[ratio] What a catalogue states of the motor's inertia may be off by this. Origin:
    28457f47."""


class load_side_run:
    """`mechanics/load_side/run.py`."""

    # USED, FAST, TORQUE_SHARE: Share of the permitted travel to each side, of the permitted speed,
    # and of the torque beyond friction that is used.
    USED = 0.8
    """[ratio] Origin: 28457f47."""
    FAST = 0.85
    """[ratio] Origin: 28457f47."""
    TORQUE_SHARE = 0.5
    """[ratio] Origin: 28457f47."""
    # QUARTERS_S, BEYOND: A triangle of speed lasts four times the first of these with which its
    # acceleration is so many times what friction decelerates, else the last.
    QUARTERS_S = (0.3, 0.2, 0.14)
    """[s] Origin: 28457f47."""
    BEYOND = 2.5
    """[ratio] Origin: 28457f47."""
    # CORNER_S, CYCLES: Corners are rounded over this; so many triangles in a group.
    CORNER_S = 0.03
    """[s] Origin: 28457f47."""
    CYCLES = 2
    """[count] Origin: 28457f47."""
    # LEVELS, REPEATS: Accelerations of the groups, as shares of the largest; how often they follow.
    LEVELS = (1.0, 0.75, 0.5)
    """[ratio] Origin: 28457f47."""
    REPEATS = 3
    """[count] Origin: 28457f47."""
    # CONTACT, LATE_S: In this share of a quarter the gap is crossed, and the load settles; before
    # the next corner the filter would see it.
    CONTACT = 0.5
    """[ratio] Origin: 28457f47."""
    LATE_S = 0.035
    """[s] Origin: 28457f47."""
    # RAMP_S, SETTLE_S, DWELL_S, POSITIONING_S: Ramps of the slow passes, what does not count behind
    # them, standstill between moves, time of the way to where they begin.
    RAMP_S = 0.2
    """[s] Origin: 28457f47."""
    SETTLE_S = 0.2
    """[s] Origin: 28457f47."""
    DWELL_S = 0.15
    """[s] Origin: 28457f47."""
    POSITIONING_S = 0.8
    """[s] Origin: 28457f47."""
    # PASSES, SLOW_RPM, SLOW_SHARE: Slow passes, their speed where there is time for it, and the
    # share of the permitted speed that they may have at most.
    PASSES = 6
    """[count] Origin: 28457f47."""
    SLOW_RPM = 20.0
    """[rpm] Origin: 28457f47."""
    SLOW_SHARE = 0.3
    """[ratio] Origin: 28457f47."""
    # WHOLE, WIDER: The passes cover so many load revolutions, and so many strokes of the moves.
    WHOLE = 1.1
    """[rev] Origin: 28457f47."""
    WIDER = 1.1
    """[ratio] Origin: 28457f47."""
    # LEAST_RPS, LEAST_REV, SPARE_S: Slower and shorter moves show nothing; ways to where the moves
    # begin take this time.
    LEAST_RPS = 0.2
    """[rev/s] Origin: 28457f47."""
    LEAST_REV = 0.2
    """[rev] Origin: 28457f47."""
    SPARE_S = 6.0
    """[s] Origin: 28457f47."""


class measuring_alignment:
    """`measuring/alignment.py`."""

    COMPARED = 400
    """[count] Rows of a run that are compared: enough to show one place of a sequence from another.
    Origin: b6929249."""
    SURE = 15
    """[count] Moved setpoints that must agree before a place is trusted, where a sequence has as
    many. Origin: b6929249."""


class measuring_excite:
    """`measuring/excite.py`."""

    # SPEED_CORNER_HZ, POSITION_CORNER_HZ: Above it the lines of a loop's reference fall.
    SPEED_CORNER_HZ = 40.0
    """[Hz] Origin: 66bd184e."""
    POSITION_CORNER_HZ = 20.0
    """[Hz] Origin: 66bd184e."""
    LOOP_CORNER_HZ = 60.0
    """[Hz] Below half of its own torque's share a line is lost in friction; above it, speed runs
    away. Origin: 76d84383."""
    PERIOD_S = 0.65
    """[s] Length of one period of the excitation. Origin: f0621549."""
    BASE_OVER_RMS = 8.0
    """[ratio] Base motion as a multiple of the excitation's own speed, so that the speed seldom
    reverses. Origin: f0621549."""
    BASE_LEAST_RAD_S = 12.0
    """[rad/s] Least speed of the base motion. Origin: f0621549."""
    BASE_SHARE = 0.4
    """[ratio] Share of the envelope's speed for the base motion; its way in overshoots. Origin:
    ba28e55a."""
    BASE_GLADLY = 0.25
    """[ratio] Share of the speed that it takes where torque affords it: a load that swings moves
    the motor more than a rigid one, by an amount that is unknown before. Origin: 2f3875f1 with
    benchmarks/analysis_comparison."""
    # RISE_HZ, RISE_MOST: Without a loop, lines rise from this frequency on, up to this factor.
    RISE_HZ = 120.0
    """[Hz] Origin: ba28e55a."""
    RISE_MOST = 2.5
    """[ratio] Origin: ba28e55a."""


class measuring_recording:
    """`measuring/recording.py` and `measuring/pair.py`."""

    RENEW_S = 0.03
    """[s] Period of the setpoints' renewal. Origin: f0621549."""
    STATE_TIMEOUT_S = 5.0
    """[s] Longest wait for a change of the power state. Origin: 971882ae."""
    TAIL_S = 1.0
    """[s] Samples arrive in bunches; this long after the last setpoint all of them have come.
    Origin: 76d84383."""
    RUN_IN = 8
    """[count] Cycles that are kept from before the motion: its first setpoint goes out in the next
    one. Origin: f50a8ed5."""


class measuring_restore:
    """`measuring/restore.py`."""

    STANDS_S = 0.5
    """[s] Time within which the axis must stand before values are restored. Origin: db67293b."""


class measuring_waveform:
    """`measuring/waveform.py`."""

    PERIOD_S = 0.65
    """[s] Length of one period of a chirp or PRBS. Origin: f0621549."""
    # MOST_TONES, FEWEST_TONES, STEPPED_S: A stepped sine has at most this many tones, and fewer
    # where they would take longer than this.
    MOST_TONES = 40
    """[count] Origin: 19b8d863."""
    FEWEST_TONES = 14
    """[count] Origin: 19b8d863."""
    STEPPED_S = 9.0
    """[s] Origin: 19b8d863."""
    # CYCLES, SETTLE_CYCLES, SETTLE_S, MEASURE_S, TONE_RAMP_S: Stepped sine: cycles of a tone that
    # are measured, cycles of its settling, least times of both, and its ramp.
    CYCLES = 4
    """[cycles] Origin: 19b8d863."""
    SETTLE_CYCLES = 2
    """[cycles] Origin: 19b8d863."""
    SETTLE_S = 0.03
    """[s] Origin: 19b8d863."""
    MEASURE_S = 0.08
    """[s] Origin: 19b8d863."""
    TONE_RAMP_S = 0.02
    """[s] Origin: 19b8d863."""


class moves_end_search:
    """`moving/moves/end_search.py`."""

    # STALL_S, START_S: So long at standstill is an end; the axis' own start is not judged.
    STALL_S = 0.12
    """[s] Origin: 7166e5a3 with benchmarks/tune_accuracy."""
    START_S = 0.25
    """[s] Origin: 7166e5a3 with benchmarks/tune_accuracy."""


class moves_go_back:
    """`moving/moves/go_back.py`."""

    # NEAR_REV, NEAR: Nearer than the larger of these (turns, share of the travel) is near enough.
    NEAR_REV = 0.02
    """[rev] Origin: 76c87fed with docs/tuning-accuracy.md."""
    NEAR = 0.0125
    """[ratio] Origin: 76c87fed with docs/tuning-accuracy.md."""
    ATTEMPTS = 3
    """[count] Moves home, until the axis is where it was. Origin: 76d84383."""
    # FAR_REV, FAR: Farther away after these moves than the larger of these (turns, share of the
    # travel), the axis has not come back.
    FAR_REV = 0.05
    """[rev] Origin: tests/virtual/tools/test_begins_at_home.py, within which an axis is back."""
    FAR = 0.1
    """[ratio] Origin: as FAR_REV; below the share of sweep_play.AWAY."""
    # MISSED_REV, MISSED: So much more is asked for at most, in turns and as a share of the travel.
    MISSED_REV = 0.3
    """[rev] Origin: 76c87fed with docs/tuning-accuracy.md."""
    MISSED = 0.2
    """[ratio] Origin: 76c87fed with docs/tuning-accuracy.md."""
    # SHARES, DISTINGUISHED_REV: What share of a way a loop goes, and moves that are different
    # enough to show.
    SHARES = (0.4, 1.5)
    """[ratio] Origin: f9af5d30 with benchmarks/chaos/run."""
    DISTINGUISHED_REV = 0.02
    """[rev] Origin: f9af5d30 with benchmarks/chaos/run."""
    SLOWEST = 4.0
    """[ratio] So many times slower a move becomes at most that takes too much torque: a sixteenth
    of it goes into acceleration then. Origin: c27c6c74."""


class moves_homing:
    """`moving/moves/homing.py`."""

    POLL_S = 0.02
    """[s] Period of reading the status word. Origin: a412d0d6."""


class moves_identification:
    """`moving/moves/identification.py`."""

    POLL_S = 0.02
    """[s] Period of reading the status word. Origin: a412d0d6."""
    BEGIN_S = 2.0
    """[s] The drive must show within this time that it has begun. Origin: 71484254."""


class moves_move:
    """`moving/moves/move.py`."""

    POLL_S = 0.02
    """[s] Period of reading the status word. Origin: a412d0d6."""
    ACKNOWLEDGE_S = 0.1
    """[s] Longest wait for the setpoint acknowledge bit. Origin: 08f8d0c6."""


class moves_procedures:
    """`moving/moves/procedures.py`."""

    POLL_S = 0.1
    """[s] Period of reading the condition of a wait step. Origin: a412d0d6."""


class moves_small_move:
    """`moving/moves/small_move.py`."""

    # FIRST_INCREMENTS, LONGER: Increments of the first move at most, and by how much the next may
    # be longer.
    FIRST_INCREMENTS = 1_000
    """[count] Origin: 084d9723."""
    LONGER = 10
    """[count] Origin: 084d9723."""
    # MOVE_S, REST_S: Length of the move, and of the dwell after it.
    MOVE_S = 2.0
    """[s] Origin: 084d9723."""
    REST_S = 0.25
    """[s] Origin: 084d9723."""
    TORQUE_PERCENT = (1.0, 50.0)
    """[%] Bounds of the torque limit of a small move. Origin: 084d9723."""
    # MARGIN, MARGIN_INCREMENTS: Envelope beyond the commanded way: share of it, and increments.
    MARGIN = 0.25
    """[ratio] Origin: 084d9723."""
    MARGIN_INCREMENTS = 50
    """[count] Origin: 084d9723."""
    ARRIVED = 0.1
    """[ratio] Share of the way that may be missing. Origin: 084d9723."""


class moves_strokes:
    """`moving/moves/strokes.py`."""

    # USED, FAST: Share of the permitted travel to each side that is used, and of the permitted
    # speed.
    USED = 0.8
    """[ratio] Origin: 16e1fbc9."""
    FAST = 0.9
    """[ratio] Origin: 16e1fbc9."""
    # RAMP_S, SETTLE_S, DWELL_S: Time of a ramp at least, and before a plateau counts; standstill
    # between two strokes.
    RAMP_S = 0.15
    """[s] Origin: 16e1fbc9."""
    SETTLE_S = 0.2
    """[s] Origin: 16e1fbc9."""
    DWELL_S = 0.15
    """[s] Origin: 16e1fbc9."""
    RAMP_SHARE = 0.35
    """[ratio] Share of the torque beyond friction that ramps take. Origin: 16e1fbc9."""


class notch_effect:
    """`tuning/notch/effect.py`."""

    # PLACE, LOWEST_HZ, HIGHEST_HZ: Where the notch is tried: share of the sample rate, and limits
    # in Hz.
    PLACE = 0.12
    """[ratio] Origin: 7166e5a3 with benchmarks/tune_accuracy."""
    LOWEST_HZ = 55.0
    """[Hz] Origin: 7166e5a3 with benchmarks/tune_accuracy."""
    HIGHEST_HZ = 400.0
    """[Hz] Origin: 7166e5a3 with benchmarks/tune_accuracy."""
    SHARE_OF_TORQUE = 0.35
    """[ratio] Share of the permitted torque that a trial takes. Origin: 7166e5a3 with
    benchmarks/tune_accuracy."""
    SLOWER = 0.7
    """[ratio] What was too fast for the envelope is played with so much less torque and speed.
    Origin: ab18ade0."""
    ATTEMPTS = 3
    """[count] A trial that lost samples is made again, so many times in all. Origin: b5755842."""
    NEAR = 0.4
    """[ratio] Share of the travel within which the next trial may begin. Origin: e3bffcb4 with
    benchmarks/tune_accuracy."""
    # STILL_FROM_HZ, STILL_REV, STILL_RPM: An axis that only trembles: its lines begin here, and it
    # may go so far and so fast. Nothing holds it, so that rounded torques let it drift by some
    # hundredths of a revolution.
    STILL_FROM_HZ = 30.0
    """[Hz] Origin: d2357b61 with docs/tuning-accuracy.md."""
    STILL_REV = 0.3
    """[rev] Origin: d2357b61 with docs/tuning-accuracy.md."""
    STILL_RPM = 150.0
    """[rpm] Origin: d2357b61 with docs/tuning-accuracy.md."""
    LEAST_ROOM_REV = 0.1
    """[rev] Less than this to the nearest end is too little for it. Origin: d2357b61 with
    docs/tuning-accuracy.md."""


class notch_filters:
    """`tuning/notch/filters.py`."""

    UNKNOWN_DEPTH_DB = -40.0
    """[dB] Depth shown for families whose manual prints none; the effect has to be measured.
    Origin: e01bb3d6."""
    ELSEWHERE = 0.1
    """[ratio] A notch that is read back this far from its centre is another one. Origin:
    6fdeae6a."""


class notch_in_loop:
    """`tuning/notch/in_loop.py`."""

    HIGHEST_MS = 3.0
    """[ratio] Whatever a notch may be, the loop's sensitivity stays below this while it is tried.
    Origin: e15b4fe3 with docs/tuning-accuracy.md."""
    # WIDTHS, DEPTHS: What a notch may be: width as a share of its centre, depth in dB.
    WIDTHS = (0.05, 0.3, 1.0, 2.5)
    """[ratio] Origin: e15b4fe3 with docs/tuning-accuracy.md."""
    DEPTHS = (-6.0, -20.0, -45.0)
    """[ratio] Origin: e15b4fe3 with docs/tuning-accuracy.md."""
    NEAR = 0.15
    """[ratio] Share of the travel within which the next trial may begin: the loop leads the axis
    back but for what friction and a pull take of it. Origin: 73639f9f with
    docs/tuning-accuracy.md."""
    FEWEST_PERIODS = 2
    """[count] Fewer show nothing of noise. Origin: b5755842."""


class notch_trials:
    """`tuning/notch/trials.py`."""

    WIDTHS = (0.5, 0.2)
    """[ratio] Widths in shares of the centre (Hz), or level pairs (width, depth). Origin: 7166e5a3
    with benchmarks/tune_accuracy."""
    # LEAST_WIDTHS, LEAST_LEVELS, BEFORE, TRIAL_S: Values that are tried at least, of a width alone
    # and of levels; plays before the first of them; seconds that each takes with all that comes
    # around it.
    LEAST_WIDTHS = 1
    """[count] Origin: 76c87fed with docs/tuning-accuracy.md."""
    LEAST_LEVELS = 4
    """[count] Origin: 76c87fed with docs/tuning-accuracy.md."""
    BEFORE = 2
    """[count] Origin: 76c87fed with docs/tuning-accuracy.md."""
    TRIAL_S = 2.9
    """[s] Origin: 76c87fed with docs/tuning-accuracy.md."""


class shaping_evaluate:
    """`tuning/shaping/evaluate.py`."""

    LEAD_S = 0.1
    """[s] Standstill before the first move of a pair. Origin: docs/slow-vibration.md."""
    SKIP_S = 0.1
    """[s] After the end of the setpoints an axis still catches up with them; so long it is not
    judged. Origin: docs/slow-vibration.md."""
    NEAR = 0.3
    """[ratio] A mode whose frequency is stated is looked for this far on both sides. Origin:
    docs/slow-vibration.md."""
    ROUNDING = 0.02
    """[ratio] An EI shaper leaves its whole tolerance at its centre; so much more is none. Origin:
    docs/slow-vibration.md."""
    SEEN = 0.9
    """[ratio] Share of the samples of a ring-down that must have come. Origin:
    docs/slow-vibration.md."""
    SETTLED = 0.1
    """[ratio] Settled is when so much of the unshaped vibration is left. Origin:
    docs/slow-vibration.md."""
    NOISES = 4.0
    """[ratio] A settling window is so many times the noise at least. Origin:
    docs/slow-vibration.md."""
    HALVED = 0.5
    """[ratio] A shaper is verified where residual or settling time is at most this share. Origin:
    docs/slow-vibration.md."""
    PERIODS = 3.0
    """[count] Periods that a ring-down holds at least. Origin: docs/slow-vibration.md."""


class shaping_run:
    """`tuning/shaping/run.py`."""

    BETWEEN_S = 0.2
    """[s] Standstill between two pairs of moves. Origin: docs/slow-vibration.md."""
    LONGEST_PERIODS = 1.1
    """[count] The longest shaper takes one period of the mode, more where it is damped. Origin:
    docs/slow-vibration.md."""


class step_evaluate:
    """`moving/step/evaluate.py`."""

    NOISES = 10.0
    """[ratio] A settling window is so many times the noise at least: what leaves a narrower one is
    noise. Origin: ed1a5f9a with benchmarks/rough_campaign."""
    LEAD_S = 0.05
    """[s] Rest before the step. Origin: 66bd184e with benchmarks/tune_accuracy."""
    GAP_S = 0.003
    """[s] Longest gap in the samples that hides no peak and no departure from the window: a loop
    of 100 Hz overshoots for 5 ms. Origin: test_step_lost.py."""


class sweep_evaluation:
    """`tuning/sweep/evaluation.py`."""

    # SLOW_HZ, SLOWER: A current loop is not slower than this, nor than this share of what the drive
    # shows.
    SLOW_HZ = 450.0
    """[Hz] Origin: e8f9e730."""
    SLOWER = 0.7
    """[ratio] Origin: e8f9e730."""
    BY_REFERENCE_S = 15e-6
    """[s] What is charged to all lines where a speed loop's reference was the excitation, one
    deviation: a setpoint that is held until it is sampled shows next to nothing of current loop and
    delay, which the loop's own torque has to, and that is small on heavy axes. Origin: 7020a899."""
    CUT = 0.25
    """[ratio] With more of its samples at one torque while more was commanded, the drive cuts the
    torque and no mechanics are looked for; as SATURATED of `tuning/autotune/run.py`. Origin:
    7166e5a3."""
    ROUNDS = 3
    """[count] A speed loop's gain and the mechanics are found in turn, so often at most. Origin:
    7bd7faec."""


class sweep_play:
    """`tuning/sweep/play.py`."""

    AWAY = 0.15
    """[ratio] Share of the travel from home beyond which nothing more begins. Origin: 347f4a26."""
    AGAIN = 2
    """[count] A sequence that lost samples is played again, so many times at most, where no period
    is whole. Origin: 347f4a26."""
    # ATTEMPTS, WEAKER, SLOWER: What came to the envelope is played again, this much smaller and
    # with so much less base motion.
    ATTEMPTS = 4
    """[count] Origin: c1f812dc."""
    WEAKER = 0.4
    """[ratio] Origin: c1f812dc."""
    SLOWER = 0.7
    """[ratio] Origin: c1f812dc."""


class sweep_profile_speed:
    """`tuning/sweep/profile_speed.py`."""

    RAMP_MS = 0
    """[ms] Ramps that are times may be 0 (003:318); others become as steep as this. Origin:
    c71e9acb."""
    RAMP_RPM_S = 1e6
    """[rpm/s] Steepness of ramps that are accelerations. Origin: c71e9acb."""
    SLOW_RPM_S = 1500.0
    """[rpm/s] While the sign of a speed is tried: from 0 to the highest speed in this time, at this
    speed. Origin: c71e9acb."""
    # TRIED_RPM, TRIED_S: Speed and length of the trial of a speed's sign.
    TRIED_RPM = 20.0
    """[rpm] Origin: c71e9acb."""
    TRIED_S = 0.25
    """[s] Origin: c71e9acb."""
    # ALLOWED_RPM, ALLOWED_REV: Envelope of that trial.
    ALLOWED_RPM = 60.0
    """[rpm] Origin: c71e9acb."""
    ALLOWED_REV = 0.25
    """[rev] Origin: c71e9acb."""
    ABOVE = 1.2
    """[ratio] The drive's own torque limit lies above the envelope's, so that the loop sees who
    exceeds it. Origin: c71e9acb."""


class sweep_velocity_noise:
    """`tuning/sweep/velocity_noise.py`."""

    NOISE = (0.2, 0.45)
    """[ratio] Nothing of a slow move is up here, so what is there is noise; shares of the sample
    rate. Origin: ff03716d."""
    CLEARLY = 4.0
    """[ratio] The position must be quieter by this much (power): the drive's own speed knows more
    otherwise. Origin: ff03716d."""
    WINDOW = 512
    """[count] Window of the power density. Origin: ff03716d."""


class sweep_speed_injection:
    """`tuning/sweep/speed_injection.py`."""

    FIRST_RAD_S = 0.3
    """[rad/s] Peak of the first trial in rad/s: even a high gain makes little torque of it. Origin:
    7166e5a3 with benchmarks/tune_accuracy."""
    # SPEED_SHARE, REFERENCE_SHARE: Shares of the permitted speed: for what the axis makes of the
    # excitation, and for the highest setpoint. A drive that nothing watches goes on with that when
    # the computer falls silent.
    SPEED_SHARE = 0.3
    """[ratio] Origin: 5ab331b5."""
    REFERENCE_SHARE = 0.9
    """[ratio] Origin: 5ab331b5."""
    # UNWATCHED_SPEED_SHARE, UNWATCHED_REFERENCE_SHARE: The same of a drive that no watchdog stops
    # when setpoints end.
    UNWATCHED_SPEED_SHARE = 0.15
    """[ratio] Origin: 5ab331b5."""
    UNWATCHED_REFERENCE_SHARE = 0.5
    """[ratio] Origin: 5ab331b5."""
    # TORQUE_SHARE, LEAST_BASE: Share of the permitted torque for excitation and base motion
    # together, and what is left of the base motion at least.
    TORQUE_SHARE = 0.7
    """[ratio] Origin: 3fdbbd99 with docs/tuning-accuracy.md."""
    LEAST_BASE = 0.4
    """[ratio] Origin: 3fdbbd99 with docs/tuning-accuracy.md."""
    # WEIGHTS, BY_DOUBT: Deviations of lines are assumed to differ by so much, relative to the
    # median; and the power of it.
    WEIGHTS = (0.1, 4.0)
    """[ratio] Origin: 3fdbbd99 with docs/tuning-accuracy.md."""
    BY_DOUBT = 0.5
    """[ratio] Origin: 3fdbbd99 with docs/tuning-accuracy.md."""
    PEAK_OVER_RMS = 2.5
    """[ratio] Peak of what the axis makes of it over its deviation: mechanics turn the phases that
    make it low. Origin: 3fdbbd99 with docs/tuning-accuracy.md."""
    RMS_OVER_PEAK = 0.7
    """[ratio] Deviation of the reference over its peak. Origin: 3fdbbd99 with
    docs/tuning-accuracy.md."""
    UPPER = 0.75
    """[ratio] Only above this share of the lines does the reference alone make the torque. Origin:
    7166e5a3 with benchmarks/tune_accuracy."""


class sweep_texts:
    """`tuning/sweep/texts.py`: phase margin in deg, gain margin in dB and Ms of a loop."""

    SOUND = (45.0, 8.0, 2.0)
    """[deg, dB, ratio] A loop is called sound from here. Origin: docs/tuning.md."""
    POOR = (30.0, 6.0, 2.5)
    """[deg, dB, ratio] Beyond these it is called unsafe. Origin: docs/tuning.md."""


class vibration_evaluate:
    """`watching/vibration/evaluate.py`."""

    LOWEST_HZ = 5.0
    """[Hz] Below, a component of the speed is part of what the loop still settles. Origin:
    docs/vibration.md."""
    BAND = 0.4
    """[ratio] Share of the sample rate up to which components are stated; what lies above its half
    is folded. Origin: docs/vibration.md."""
    PERIODS = 3.0
    """[count] Periods that a plateau holds of a component at least. Origin: docs/vibration.md."""
    # BLOCKS, EVEN: Blocks of a plateau, and how far their speed may differ from the mean.
    BLOCKS = 6
    """[count] Origin: docs/vibration.md."""
    EVEN = 0.3
    """[ratio] Origin: docs/vibration.md."""
    ARRIVED = 0.7
    """[ratio] A plateau of which less arrived is not used. Origin: docs/vibration.md."""
    PEAK = 2.0
    """[ratio] A level over those beside it from which on further speeds are measured about it.
    Origin: docs/vibration.md."""
    # MATTERS, SAME_SPEED: An order with less than this share of the largest acceleration at a speed
    # asks for no further speeds and no further look; speeds that differ by less are one.
    MATTERS = 0.3
    """[ratio] Origin: docs/vibration.md."""
    SAME_SPEED = 0.02
    """[ratio] Origin: docs/vibration.md."""
    PARTS = 3
    """[count] Components that are listed of one speed. Origin: docs/vibration.md."""
    # WHOLE, AS_WHOLE: An interval wider than this does not show whether an order is a whole number;
    # one that is a whole number to this share is, which covers scales that are rounded.
    WHOLE = 0.2
    """[1/rev] Origin: docs/vibration.md."""
    AS_WHOLE = 2e-4
    """[ratio] Origin: docs/vibration.md."""
    NEAR = 0.15
    """[ratio] A speed this close to that of a resonance shows its level. Origin:
    docs/vibration.md."""
    EXCITES = 0.2
    """[ratio] Orders that excite a resonance to less than this share of the largest level are not
    listed. Origin: docs/vibration.md."""
    STANDS_OUT = 18.0
    """[ratio] As `sinusoids` of the analysis has it, for what would have been seen. Origin:
    docs/vibration.md."""


class vibration_run:
    """`watching/vibration/run.py`."""

    # RANGE, LEAST_RANGE: Fastest over slowest speed where the settings name none; the slowest one
    # is below this share of the fastest.
    RANGE = 12.0
    """[ratio] Origin: docs/vibration.md."""
    LEAST_RANGE = 0.6
    """[ratio] Origin: docs/vibration.md."""
    LEAST_CLOSER = 3
    """[count] Fewer further speeds show no shape of the level, unless fewer are asked for. Origin:
    a peak needs a speed on either side."""
    # LONGEST_S, ENOUGH_S, SHORT_S: A plateau is no longer; one that is shorter is repeated; and no
    # speed is measured whose plateaus would be shorter still.
    LONGEST_S = 1.2
    """[s] Origin: docs/vibration.md."""
    ENOUGH_S = 0.6
    """[s] Origin: docs/vibration.md."""
    SHORT_S = 0.3
    """[s] Origin: docs/vibration.md."""
    POSITIONING = 0.25
    """[ratio] Share of the permitted speed that the ways between plateaus take. Origin:
    docs/vibration.md."""


class dwell_evaluate:
    """`moving/dwell/evaluate.py`."""

    HARMONICS = 4
    """[count] Multiples of the frequency that are looked for, the first one included. Origin:
    docs/vibration.md."""
    BAND = 0.4
    """[ratio] Share of the sample rate up to which multiples are stated. Origin:
    docs/vibration.md."""
    FEWEST = 4
    """[count] Blocks below which nothing is stated. Origin: docs/vibration.md."""
    SEEN = 4.0
    """[ratio] An amplitude over the deviation of its mean that is seen. Origin:
    docs/vibration.md."""
    NOT_LINEAR = 0.1
    """[ratio] A multiple with this share of the amplitude is named. Origin: docs/vibration.md."""
    # CHANGED, CLEAR: The level changed by this share, and so many deviations, over the time.
    CHANGED = 0.1
    """[ratio] Origin: docs/vibration.md."""
    CLEAR = 3.0
    """[ratio] Origin: docs/vibration.md."""
    STEP = 0.5
    """[count] Nothing is known better than this share of a step of position or torque. Origin:
    docs/vibration.md."""
    LOST = 0.02
    """[ratio] Share of lost samples that is named. Origin: docs/vibration.md."""


class dwell_run:
    """`moving/dwell/run.py`."""

    # LEAD_S, FADE_S: Standstill before and after, and how long the sine grows and falls.
    LEAD_S = 0.1
    """[s] Origin: docs/vibration.md."""
    FADE_S = 0.5
    """[s] Origin: docs/vibration.md."""
    LONGEST_S = 60
    """[s] Longest time at full amplitude, as of its setting. Origin: docs/vibration.md."""
    # RAMP_S, STROKE_S: Ramps of the slow speed, and how long a stroke of it lasts at most.
    RAMP_S = 0.3
    """[s] Origin: docs/vibration.md."""
    STROKE_S = 3.0
    """[s] Origin: docs/vibration.md."""
    TURNING = 0.3
    """[ratio] Share of the slow speed from which on a stroke of it counts. Origin:
    docs/vibration.md."""
    HIGHEST = 0.25
    """[ratio] Share of the sample rate up to which setpoints carry a sine: four of them a period.
    Origin: docs/vibration.md."""
    # USED, FAST, SHARE: Of the limits of travel, speed and torque that are used.
    USED = 0.7
    """[ratio] Origin: docs/vibration.md."""
    FAST = 0.8
    """[ratio] Origin: docs/vibration.md."""
    SHARE = 0.8
    """[ratio] Origin: docs/vibration.md."""
    STEPS = 3.0
    """[count] Steps of the setpoint that an amplitude has at least. Origin: docs/vibration.md."""
    LIVE_S = 0.3
    """[s] The amplitude that is shown meanwhile is of so long. Origin: docs/vibration.md."""


class trend_compare:
    """`watching/trend/compare.py`."""

    FALSE_ALARMS = 0.01
    """[ratio] Probability of a false alarm in one comparison of an axis, for all quantities
    together. Origin: b68b54c1 with tests/unit/health."""
    LEAST_REPEATS = 3
    """[count] Smallest number of repeats; with fewer the spread is not known well enough. Origin:
    b68b54c1 with tests/unit/health."""
    CHECKS = 2
    """[count] Number of newest checks that are compared. Origin: b68b54c1 with
    tests/unit/health."""
    JUDGED = 2
    """[count] Number of resonances that are judged; further ones are shown only. Origin: b68b54c1
    with tests/unit/health."""
    ANOTHER = 1.5
    """[ratio] A resonance that differs by more than this factor is a different one. Origin:
    b68b54c1 with tests/unit/health."""
    FINEST = 1e-3
    """[ratio] Smallest relative standard deviation that is assumed, however well repeats agree.
    Origin: b68b54c1 with tests/unit/health."""


class trend_permission:
    """`watching/trend/permission.py`."""

    KEPT = 50
    """[count] Number of attempts that are stored with a permission. Origin: b68b54c1."""


class cycle_evaluate:
    """`watching/cycle/evaluate.py`."""

    FEWEST = 20
    """[count] Smallest number of samples that is evaluated. Origin: 67963fe4."""
    IDLE_PERCENT = 0.5
    """[%] Below this torque, of the rated one, and `IDLE_RPM`, the axis is idle. Origin:
    67963fe4."""
    IDLE_RPM = 1.0
    """[rpm] See `IDLE_PERCENT`. Origin: 67963fe4."""
    AT_LIMIT = 0.98
    """[ratio] A torque peak from this share of the limit on is limited by it. Origin: 67963fe4."""
    OVER_SPEED = 1.02
    """[ratio] A speed up to this factor of the rated speed is accepted. Origin: 67963fe4."""
    SLOW_HZ = 50.0
    """[Hz] Slower sampling misses short acceleration peaks, and the result says so. Origin:
    67963fe4."""
    CELLS = 40
    """[count] Cells of the cloud in each direction; one sample of each is shown. Origin:
    67963fe4."""


class cycle_run:
    """`watching/cycle/run.py`."""

    SLOW_S = 1.0
    """[s] Interval for reading slowly changing values. Origin: 67963fe4."""
    STEP_S = 0.25
    """[s] Interval at which the progress is reported. Origin: 67963fe4."""


class cycle_texts:
    """`watching/cycle/texts.py`."""

    BINS = 24
    """[count] Bins of speed in the drawing of torque over speed. Origin: 67963fe4."""


class safety_check_evaluate:
    """`watching/safety_check/evaluate.py`."""

    LEFT = 0.9
    """[ratio] A speed below this share of the commanded one, for `LASTS_S`, is a sign of the
    function. Origin: 653af5ab."""
    LASTS_S = 0.01
    """[s] See `LEFT`. Origin: 653af5ab."""
    STEADY_S = 0.15
    """[s] The commanded speed must have been constant for this time, so that a run-up is not
    mistaken for a sign. Origin: 653af5ab."""
    WINDOW_S = 0.02
    """[s] Window of the speed by position. Origin: 653af5ab."""
    STANDSTILL_SHARE = 0.02
    """[ratio] Standstill is below the greater of this share of the speed and `STANDSTILL_RPM`.
    Origin: 653af5ab."""
    STANDSTILL_RPM = 3.0
    """[rpm] See `STANDSTILL_SHARE`. Origin: 653af5ab."""
    SETTLED = 0.002
    """[ratio] The axis has stopped where no more than this share of the distance, or
    `RESOLVED_REV`, is left. Origin: 653af5ab."""
    RESOLVED_REV = 2e-4
    """[rev] See `SETTLED`. Origin: 653af5ab."""
    DEVIATIONS = 5.0
    """[count] Standard deviations of the noise without power that a torque must exceed. Origin:
    653af5ab."""
    LEAST_PERCENT = 0.3
    """[%] Smallest torque, of the rated one, that is distinguished. Origin: 653af5ab."""
    FILTER = 5
    """[count] Samples of the median filter of the torque. Origin: 653af5ab."""
    DISTINCT = 3.0
    """[ratio] The torque before the trigger must be this many times the noise, or its end is not
    determined. Origin: 653af5ab."""
    BEFORE_S = 0.1
    """[s] Time before the trigger over which that torque is measured. Origin: 653af5ab."""
    AT_STANDSTILL = 0.1
    """[ratio] With SS1 the power is removed at standstill: below this share of the speed. Origin:
    653af5ab."""
    SPEED_MARGIN = 0.05
    """[ratio] Share by which the speed limit may be exceeded. Origin: 653af5ab."""
    SHOWN_BEFORE_S = 0.2
    """[s] Time before the trigger that the drawing shows. Origin: 653af5ab."""
    FOLLOWED = 0.95
    """[ratio] Share of the test speed above which the drive did not react. Origin: 653af5ab."""


class safety_check_run:
    """`watching/safety_check/run.py`."""

    LEAD_S = 0.3
    """[s] Time without power before the run, for the noise of the torque. Origin: 653af5ab."""
    RAMP_S = 0.4
    """[s] Duration of a ramp. Origin: 653af5ab."""
    END_S = 0.3
    """[s] Time that is recorded after the end. Origin: 653af5ab."""
    SIGN_SHARE = 0.9
    """[ratio] A sign is a speed below this share of the commanded one in `SIGN_ROWS` successive
    rows. Origin: 653af5ab."""
    SIGN_ROWS = 10
    """[count] See `SIGN_SHARE`. Origin: 653af5ab."""
    USED = 0.85
    """[ratio] Used share of the travel, which leaves room for the run-down. Origin: 653af5ab."""
    BELOW_LIMIT = 0.8
    """[ratio] For the speed limit, the axis first runs at this share of it. Origin: 653af5ab."""
