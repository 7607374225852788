"""One step of training, compiled, and the state that it turns into the next one.

What is learned and how is all in `presets.Settings`. Every random number is folded from the seed
and the step. Over several devices, also of several processes, the batch is spread by rows and
everything else is the same everywhere; JAX sums the gradients up because the loss is a mean over
rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import Array
from jax.experimental import multihost_utils
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from numpy.typing import NDArray

from ambulo import _core
from ambulo.data import Dataset, Rows
from ambulo.models import pfnn, rollout
from ambulo.normalisation import normalisation
from ambulo.presets import Settings, SettingsError, Stage

State = dict[str, Any]
"""`params`, `optimiser`, `mean` (running mean of the weights), `carry` (of the followers), `step`,
`loss` (sum since the last report) and `count` (of steps in that sum)."""

# Share of the prediction in the pose that the runtime feeds back, as published.
PUBLISHED_FEEDBACK = 0.5


class TrainingError(RuntimeError):
    """Training went astray; the message says where and what to try."""


def connect(coordinator: str, processes: int, process: int) -> None:
    """Join the processes of a run over several machines; before anything else of JAX.

    Raises:
        TrainingError: the others were not found.
    """
    # On CPUs somebody has to carry the sums; elsewhere the accelerators do it themselves.
    jax.config.update("jax_cpu_collectives_implementation", "gloo")
    try:
        jax.distributed.initialize(coordinator, processes, process, initialization_timeout=120)
    except RuntimeError as error:
        raise TrainingError(
            f"process {process} of {processes} did not find the others at {coordinator} within two "
            f"minutes: {str(error).splitlines()[0]}"
        ) from error


# -- plans ------------------------------------------------------------------------------------


def total_steps(settings: Settings, dataset: Dataset) -> int:
    """Steps that a run has."""
    return settings.steps or math.ceil(settings.epochs * dataset.rows("training") / settings.batch)


def stage_at(settings: Settings, step: int, steps: int) -> tuple[Stage, int]:
    """The stage that a step belongs to, and the age limit there."""
    before = 0.0
    for stage in settings.stages:
        within = (step / steps - before) / stage.share if stage.share else 1.0
        before += stage.share
        if step < round(before * steps):
            break
    else:
        stage, within = settings.stages[-1], 1.0
    grown = (stage.age_end or stage.age) - stage.age
    return stage, stage.age + round(grown * min(max(within, 0.0), 1.0))


def followers(settings: Settings, stage: Stage) -> int:
    """Windows in a batch of a stage."""
    return stage.batch or max(settings.batch // stage.frames, 1)


def wiring(dataset: Dataset) -> rollout.Wiring:
    """Where the numbers of the data set's rows lie."""

    def span(piece: slice) -> tuple[int, int]:
        return piece.start, piece.stop

    columns, x, y = dataset.columns, dataset.blocks["inputs"], dataset.blocks["outputs"]
    path = ("trajectory_x", "trajectory_z", "direction_x", "direction_z")
    gaits = [piece for name, piece in x.items() if name.startswith("gait_")]
    return rollout.Wiring(
        phase=columns["phase"].start,
        root=columns["root"].start,
        x=span(columns["input"]),
        y=span(columns["output"]),
        trajectory_in=tuple(span(x[name]) for name in path),
        gaits_in=(gaits[0].start, gaits[-1].stop),
        position_in=span(x["joint_position"]),
        velocity_in=span(x["joint_velocity"]),
        root_out=span(y["root_velocity"]),
        yaw_out=y["root_yaw"].start,
        rate_out=y["phase_rate"].start,
        contacts_out=span(y["contacts"]),
        trajectory_out=tuple(span(y[name]) for name in path),
        position_out=span(y["joint_position"]),
        velocity_out=span(y["joint_velocity"]),
        feet=tuple(dataset.parts["feet"]["joints"]),
        unit=_core.layout(dataset.layout["name"], len(dataset.joints))["units_per_metre"],
        turn=dataset.turn,
        dt=dataset.frame,
        fps=dataset.fps,
    )


def runtime_feedback(settings: Settings, fps: float) -> float:
    """Share of the prediction in the pose that the runtime will feed back."""
    halflife = settings.tuning.get("pose_halflife")
    if halflife is None:
        return PUBLISHED_FEEDBACK
    return 1.0 - 0.5 ** (1.0 / (fps * halflife)) if halflife else 1.0


def loss_weights(dataset: Dataset, settings: Settings) -> Rows:
    """(outputs,) of each number's square in the loss; 1 on average.

    Raises:
        SettingsError: no output block has a name that is given a weight.
    """
    blocks = dataset.blocks["outputs"]
    for name in settings.block_weights:
        if name not in blocks:
            raise SettingsError(
                f"block_weights: '{name}' is no output block; there are {', '.join(blocks)}"
            )
    weights = np.ones(dataset.widths[1], np.float32)
    for name, block in blocks.items():
        size = block.stop - block.start if settings.weigh == "blocks" else 1
        weights[block] = settings.block_weights.get(name, 1.0) / size
    if not weights.any():
        raise SettingsError("block_weights: all are 0: there is nothing to learn")
    return weights / weights.mean(dtype=np.float64).astype(np.float32)


def learning_rate(settings: Settings, steps: int) -> Callable[[Any], Any]:
    """The rate as a function of the step."""
    top = settings.learning_rate
    if settings.schedule == "constant":
        rest: Callable[[Any], Any] = optax.constant_schedule(top)
    else:
        length = max(steps - settings.warmup, 1)
        rest = optax.cosine_decay_schedule(top, length, settings.final_rate / top)
    if not settings.warmup:
        return rest
    # The first step is not lost on a rate of zero.
    rise = optax.linear_schedule(top / settings.warmup, top, settings.warmup)
    return optax.join_schedules([rise, rest], [settings.warmup])


def _optimiser(settings: Settings, rate: Callable[[Any], Any]) -> optax.GradientTransformation:
    def weights_only(params: Any) -> Any:
        return [{name: name == "weight" for name in layer} for layer in params]

    adam = optax.adamw(rate, weight_decay=settings.weight_decay, mask=weights_only)
    return optax.chain(optax.clip_by_global_norm(settings.clip), adam) if settings.clip else adam


# -- the step ---------------------------------------------------------------------------------


class Trainer:
    """What does not change during a run: the data's numbers, the compiled steps."""

    def __init__(self, dataset: Dataset, settings: Settings) -> None:
        self.dataset, self.settings = dataset, settings
        self.steps = total_steps(settings, dataset)
        self.wiring = wiring(dataset)
        self.numbers = normalisation(
            dataset,
            joint_weight=settings.joint_weight,
            masked_joints=settings.masked_joints,
            floor=settings.std_floor,
            hide_constant=settings.hide_constant,
        )
        n = self.numbers
        self.scale = pfnn.Scale(n.input_mean, n.input_std, n.output_mean, n.output_std)
        self.weights = loss_weights(dataset, settings)
        self.rate = learning_rate(settings, self.steps)
        self.optimiser = _optimiser(settings, self.rate)
        mesh = Mesh(np.array(jax.devices()), "rows")
        self._alike = NamedSharding(mesh, PartitionSpec())
        self._spread = NamedSharding(mesh, PartitionSpec("rows"))
        self._learn = jax.jit(self._stepped, donate_argnums=0)
        self._judge = jax.jit(self._judged, static_argnums=2)
        for stage in settings.stages:
            if (size := followers(settings, stage)) % len(jax.devices()):
                raise SettingsError(
                    f"a batch of {size} windows cannot be shared by {len(jax.devices())} devices; "
                    "make batch a multiple"
                )

    def start(self) -> State:
        """The state before the first step."""
        widths = [self.dataset.widths[0], *self.settings.hidden, self.dataset.widths[1]]
        params = pfnn.init(jax.random.key(self.settings.seed), widths, self.settings.init)
        state = {
            "params": params,
            "optimiser": self.optimiser.init(params),
            "mean": params if self.settings.ema else [],
            "carry": rollout.nothing(0, 0),
            **zero_loss(),
            "step": np.int32(0),
        }
        return self.place(jax.tree.map(np.asarray, state))

    def place(self, state: State) -> State:
        """From plain arrays to the devices; each has memory of its own, since steps use it up."""

        def put(leaf: NDArray[Any], spread: bool) -> Array:
            if not spread or not len(leaf):
                return jax.make_array_from_process_local_data(self._alike, np.array(leaf))
            return jax.make_array_from_process_local_data(self._spread, self._own(leaf))

        return {
            name: jax.tree.map(lambda leaf, name=name: put(leaf, name == "carry"), part)
            for name, part in state.items()
        }

    def _own(self, rows: NDArray[Any]) -> NDArray[Any]:
        """This process's part of what is the same on all."""
        size = len(rows) // jax.process_count()
        return rows[size * jax.process_index() :][:size]

    def learn(self, state: State, rows: Rows, fresh: NDArray[np.bool_]) -> State:
        """One step on windows (N, frames, columns), the same on every process."""
        if len(state["carry"].phase) != len(rows):
            empty = rollout.nothing(len(rows), len(self.dataset.joints), self._options())
            empty = jax.tree.map(np.asarray, empty)
            state = {**state, **self.place({"carry": empty})}
        put = jax.make_array_from_process_local_data
        batch = (put(self._spread, self._own(part)) for part in (rows, fresh))
        return self._learn(state, *batch)

    def _options(self, left: Array | float = 1.0) -> rollout.Options:
        """The settings, with what is left of the noise."""
        s = self.settings
        return rollout.Options(
            drop_input=s.dropout_input,
            drop_hidden=s.dropout_hidden,
            noise=s.noise * left if s.noise else 0.0,
            phase_noise=s.phase_noise * left if s.phase_noise else 0.0,
            feedback=s.feedback,
            own_phase=s.own_phase,
            own_root=s.own_root,
            own_future=s.own_future,
            told_simply=s.told_simply,
            phase_pull=s.phase_pull,
            root_pull=s.root_pull,
            root_noise=s.root_noise,
            past_warp=s.past_warp,
            implied=s.implied,
            planted=s.planted,
            through_time=s.through_time,
        )

    def _stepped(self, state: State, rows: Array, fresh: Array) -> State:
        s, step = self.settings, state["step"]
        left = 1.0 + (s.noise_end - 1.0) * step / max(self.steps - 1, 1)
        options = self._options(left)
        key = jax.random.fold_in(jax.random.key(s.seed + 1), step)

        def objective(params: pfnn.Params) -> tuple[Array, rollout.Carry]:
            outcome, carry = rollout.unroll(
                params, self.scale, self.wiring, rows, carry=state["carry"], fresh=fresh,
                weights=self.weights, pose_std=self.numbers.pose_std, options=options, key=key,
            )  # fmt: skip
            return outcome.loss.mean() + s.l1 * pfnn.mean_size(params), carry

        turn = jax.value_and_grad(objective, has_aux=True)
        (loss, carry), gradient = turn(state["params"])
        change, optimiser = self.optimiser.update(gradient, state["optimiser"], state["params"])
        params = optax.apply_updates(state["params"], change)
        return {
            "params": params,
            "optimiser": optimiser,
            "mean": _blended(state["mean"], params, s.ema, step) if s.ema else [],
            "carry": carry,
            "step": step + 1,
            "loss": state["loss"] + loss,
            "count": state["count"] + 1,
        }

    # -- looking at it ------------------------------------------------------------------------

    def kept(self, state: State) -> list[dict[str, NDArray[np.float32]]]:
        """The weights that count: the running mean if there is one."""
        return jax.tree.map(np.asarray, state["mean"] or state["params"])

    def held(self, state: State) -> dict[str, NDArray[Any]]:
        """Everything by name, as plain arrays: what a checkpoint keeps.

        All processes have to ask together: each has but its part of the followers.
        """
        if jax.process_count() > 1 and len(state["carry"].phase):
            gathered = multihost_utils.process_allgather(state["carry"], tiled=True)
            state = {**state, "carry": gathered}
        leaves = jax.tree_util.tree_leaves_with_path(state)
        return {jax.tree_util.keystr(path): np.asarray(leaf) for path, leaf in leaves}

    def restored(self, arrays: Mapping[str, NDArray[Any]]) -> State | None:
        """The state from what `held` gave; None if that is another version's."""
        paths, shape = jax.tree_util.tree_flatten_with_path(self.start())
        names = [jax.tree_util.keystr(path) for path, _ in paths]
        if set(names) != arrays.keys():
            return None
        state = jax.tree_util.tree_unflatten(shape, [arrays[name] for name in names])
        return self.place(state)

    def measure(self, params: Any, judged: Rows) -> dict[str, float]:
        """One-step loss, and errors in centimetres, undisturbed, on windows (N, T, columns)."""
        one, closed = (self._judge(params, judged, loop) for loop in (False, True))
        cm = 100.0 / self.wiring.unit
        return {
            "one_step": float(one.loss.mean()),
            "one_step_cm": cm * float(one.position.mean()),
            "loop_cm": cm * float(closed.position.mean()),
            "loop_end_cm": cm * float(closed.position[-1].mean()),
        }

    def _judged(self, params: Any, rows: Array, closed: bool) -> rollout.Outcome:
        """As the runtime closes the loop, but along the clip's own trajectory."""
        feedback = runtime_feedback(self.settings, self.dataset.fps)
        options = rollout.Options(feedback=feedback, own_phase=closed, closed=closed)
        outcome, _ = rollout.unroll(
            params, self.scale, self.wiring, rows, weights=self.weights, options=options
        )
        return outcome


def _blended(mean: Any, params: Any, keep: float, step: Array) -> Any:
    """A running mean that forgets its start: early on it is short."""
    share = jnp.minimum(keep, (1.0 + step) / (10.0 + step))
    return jax.tree.map(lambda old, new: share * old + (1.0 - share) * new, mean, params)


def zero_loss() -> State:
    """The part of the state that begins anew with each report."""
    return {"loss": np.float32(0.0), "count": np.int32(0)}


def anyone(here: bool) -> bool:
    """Whether it is so on any process; all have to ask together."""
    if jax.process_count() == 1:
        return here
    return bool(multihost_utils.process_allgather(np.array(here)).any())
