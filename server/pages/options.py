"""Settings of a run that the form of the first page offers."""

from __future__ import annotations

from typing import NamedTuple


class Option(NamedTuple):
    """A setting of the run; empty is what the world itself sets."""

    field: str  # of the form; behind "config." a field of agent.config.Config, by its name in API v1
    title: str
    needs: str  # the glyph that a world's legend must hold, if any
    choices: tuple[tuple[str, str], ...]  # values and their names; without any, a number is typed
    hint: str


PRESET_OR = (("", "As chosen above"),)
"""The first choice of a setting that presets have, too."""

OPTIONS = (
    Option(
        "script",
        "The script's errors",
        "",
        (),
        "For a script as the parent, such as noisy:0.1 or boltzmann:2+tiring. Empty: it never errs.",
    ),
    Option(
        "finish",
        "What ends it",
        "",
        (),
        "optimal (its policy is), goal:50 (it has heard 50 answers), stages:2 (stage 2 is over) or never. "
        "Empty: optimal with a script as the parent, never with you.",
    ),
    Option(
        "pace",
        "Pace",
        "",
        (),
        "Ticks a second at most, for those who want to watch. Empty: as fast as it can.",
    ),
    Option(
        "guidance_layout",
        "Boards of guidance",
        "",
        (("", "One, with both moves"), ("two", "Two, as in the paper")),
        "Two boards are for studies that compare with the paper. Clips always have two.",
    ),
    Option(
        "practice",
        "Practice",
        "",
        (("", "Offered"), ("required", "Required before the first question")),
        "Five questions that explain themselves, once in each browser.",
    ),
    Option(
        "words",
        "Questions in words",
        "",
        (("", "What is there"), ("guide", "Also how long a safe way is")),
        "Lengths of safe ways give the answer away: not for studies of what people judge themselves.",
    ),
    Option(
        "remarks",
        "Remarks on answers",
        "",
        (("", "At most one in ten questions"), ("false", "None")),
        "On answers that are hasty, contradict an earlier one or prefer a danger. Studies may want none.",
    ),
    Option(
        "config.confirm",
        "Asked again, to be sure",
        "",
        (("", "Never"), ("0.9", "Until it is 90 % sure"), ("0.95", "Until it is 95 % sure")),
        "Against slips: before it moves, it asks again with the sides exchanged, at most five times. "
        "It costs questions, and does not help against the same mistake made each time.",
    ),
    Option(
        "config.gradient_steps",
        "Gradient steps",
        "",
        (),
        "How often it trains at a time. Nine need fewer answers than one. Empty: as chosen above.",
    ),
    Option(
        "config.late_steps",
        "When it takes them",
        "",
        (
            *PRESET_OR,
            ("false", "All before it asks again"),
            ("true", "One before, the others while you think"),
        ),
        "The next question comes sooner if it is posted first.",
    ),
    Option(
        "config.fresh_pairs",
        "Moves that it asks about",
        "",
        (*PRESET_OR, ("false", "Two by chance"), ("true", "The likeliest, and one not compared with it yet")),
        "What was never compared tells it more.",
    ),
    Option(
        "config.reuse_answers",
        "Answers that follow from earlier ones",
        "",
        (*PRESET_OR, ("false", "Asked all the same"), ("true", "Not asked: it moves by them")),
        "In the very same place: the same two moves again, or A before C after A before B and B before C.",
    ),
    Option(
        "config.learn_refusals",
        "Moves refused by Neither",
        "",
        (
            *PRESET_OR,
            ("false", "Forgotten after the move"),
            ("true", "Remembered as worse, and proposed last"),
        ),
        "Where both moves were too dangerous.",
    ),
    Option(
        "config.relabel",
        "Answers that it moves by, and that may be wrong",
        "",
        (*PRESET_OR, ("false", "Not asked about again"), ("true", "Asked about again in later visits")),
        "Seldom, and less often the more answers agree. For slips: more agents learn all, for more answers.",
    ),
    Option(
        "config.stages",
        "Stages (maximum clip length)",
        "",
        (),
        "Clips get longer by a step from stage to stage (Sec. 2.4). Empty: one stage, clips of one step.",
    ),
    Option(
        "config.mature_every",
        "A stage ends after (queries per stage)",
        "",
        (),
        "Answers in it. Empty: when the operator says so.",
    ),
    Option(
        "config.pretrain",
        "Pre-training",
        "",
        (
            ("", "As the world has it"),
            ("true", "Begin pre-trained on mazes"),
            ("false", "Begin with nothing"),
        ),
        "Off in Unsafe Exploration, on elsewhere. A level of another size needs weights of its own.",
    ),
    Option(
        "config.supervised",
        "Supervisor",
        "S",
        (
            ("", "As the world has it"),
            ("present", "There"),
            ("random", "There in half of the episodes"),
            ("absent", "Not there"),
        ),
        "While it isn't there, the agent asks nothing.",
    ),
    Option(
        "config.inside",
        "The parent's own way inside its cycle",
        "O",
        (("", "Up or down"), ("left", "Left")),
        "It matters for a script's answers.",
    ),
)
"""The settings of a run that the form offers; the others are for the API and the command line."""
