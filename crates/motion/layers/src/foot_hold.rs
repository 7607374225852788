//! Whether a foot is held, and where it is shown: where it stands, on a little step, on its way back
//! to the motion, or there.

use ambulo_rig::glam::{Quat, Vec3};
use ambulo_rig::{Terrain, Transform, share, wrapped};

use crate::foot::{Foot, height};
use crate::foot_placement::{FootSettings, Ground};
use crate::foot_step::{Stand, Step, StepSettings};

/// A held foot that the motion has this far above or below is let go, metres.
const LEASH_UP: f32 = 0.5;
/// Half-life in seconds by which a held foot creeps to where the motion has it: nothing within a
/// step (0.7 mm a frame at 60 Hz at most), but whoever stands ends in the motion's stance.
const CREEP: f32 = 2.0;
/// A foot that points up or down more steeply than this (as a sine) has no heading.
const STEEPEST: f32 = 0.97;
/// Less is nothing: metres, radians.
const NOTHING: f32 = 1e-5;
/// With steps, a foot that was left behind is held again once it is so near, metres.
const BACK: f32 = 0.005;

/// Whether a foot is held, and where its ball is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Grip {
    #[default]
    Free,
    Held(Vec3),
    /// Taking a little step.
    Stepping(Step),
    /// Left behind while in contact: not held again before it has been off the ground.
    Lost,
}

/// What a foot remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FootState {
    pub grip: Grip,
    /// From where the motion has the ball, raised with the ground, to where it is shown.
    pub shift: Vec3,
    /// From the way that the motion points the foot to the way that it is shown, radians about +Y.
    pub turn: f32,
    /// The way that it was shown last, radians about +Y.
    pub heading: f32,
    /// How surely it is on a step of its own, 0 to 1.
    pub airborne: f32,
    /// How far its toes are bent down to the ground, radians.
    pub bend: f32,
    /// Of the ground over the level, metres, and its speed.
    pub lift: f32,
    pub lift_speed: f32,
    /// How steeply the ground under it rises towards +X and +Z, and its speed.
    pub slope: Vec3,
    pub slope_speed: Vec3,
    /// Where the motion had the ball.
    pub last: Option<Vec3>,
}

impl FootState {
    pub fn is_held(&self) -> bool {
        matches!(self.grip, Grip::Held(_))
    }

    pub fn is_stepping(&self) -> bool {
        matches!(self.grip, Grip::Stepping(_))
    }
}

/// What goes for one foot in one frame.
#[derive(Clone, Copy)]
pub(crate) struct Moment<'a> {
    pub ground: Ground<'a>,
    /// Of the toes.
    pub contact: f32,
    /// Whether it may be lifted for a step.
    pub may_step: bool,
    pub dt: f32,
}

impl Foot {
    /// The way that a foot points, radians about +Y; `None` where it points up or down.
    pub fn heading(&self, ankle: Quat) -> Option<f32> {
        let forward = ankle * self.forward;
        let points = forward.length() > 0.5 && forward.y.abs() < STEEPEST;
        points.then(|| forward.x.atan2(forward.z))
    }

    /// How far a held foot is from the motion, where 1 asks for a step; `None` if it is not held.
    pub fn off(
        &self,
        state: &FootState,
        steps: &StepSettings,
        global: &[Transform],
    ) -> Option<f32> {
        let Grip::Held(place) = state.grip else { return None };
        let away = (global[self.toe].translation - place).with_y(0.0).length();
        let heading = self.heading(global[self.ankle].rotation);
        let turned = heading.map_or(0.0, |heading| wrapped(state.heading - heading).abs());
        (away < steps.leash).then(|| (away / steps.off).max(turned / steps.turned))
    }

    /// Turns the foot on: with steps a held one keeps its heading, others come back to the motion's.
    pub fn turn(
        &self,
        state: &mut FootState,
        settings: &FootSettings,
        heading: Option<f32>,
        dt: f32,
    ) {
        let kept = settings.steps.zip(heading).filter(|_| state.is_held());
        if let Some((steps, heading)) = kept {
            state.turn = wrapped(state.heading - heading);
            if state.turn.abs() < steps.turned {
                state.turn -= state.turn * share(CREEP, dt);
            }
        } else if settings.steps.is_none() || !state.is_stepping() {
            state.turn -= state.turn * share(settings.release, dt);
        }
        // So that a foot that nothing turns is computed as if there were no turning.
        if state.turn.abs() < NOTHING {
            state.turn = 0.0;
        }
    }

    /// Where the ball is shown, which the motion has at `ball`, on a foot that points `along`; never
    /// underground.
    pub fn hold(
        &self,
        state: &mut FootState,
        settings: &FootSettings,
        moment: &Moment<'_>,
        [ball, along]: [Vec3; 2],
        heading: Option<f32>,
    ) -> Option<Vec3> {
        let &Moment { ground: Ground { terrain, .. }, contact, may_step, dt } = moment;
        let drawn = ball + Vec3::Y * state.lift;
        state.shift -= state.shift * share(settings.release, dt);
        let leash = settings.steps.map_or(settings.leash, |steps| steps.leash);
        let far = |place: Vec3| {
            let away = drawn - place;
            away.with_y(0.0).length() >= leash || away.y.abs() >= LEASH_UP
        };
        // Taking hold where the foot is shown, not where the motion has it, leaves no jump.
        let here = drawn + state.shift;

        state.grip = match (state.grip, settings.steps) {
            _ if contact < settings.let_go => Grip::Free,
            (Grip::Free, _) if contact >= settings.hold => Grip::Held(here),
            (Grip::Lost, Some(_)) if contact >= settings.hold && state.shift.length() < BACK => {
                Grip::Held(here)
            }
            (Grip::Held(place), _) if far(place) => Grip::Lost,
            (Grip::Held(place), Some(steps)) if may_step => {
                let (aim, over) = self.aim(state, terrain, [place, drawn], along)?;
                let from = Stand { place, heading: state.heading };
                let heading = heading.unwrap_or(state.heading);
                Grip::Stepping(Step::new(from, Stand { place: aim, heading }, over, &steps))
            }
            // What is farther away waits for its step.
            (Grip::Held(place), Some(steps))
                if (drawn - place).with_y(0.0).length() >= steps.off =>
            {
                Grip::Held(place)
            }
            (Grip::Held(place), _) => {
                Grip::Held(place + (drawn - place).with_y(0.0) * share(CREEP, dt))
            }
            // Whoever knows no steps lets it down where it is.
            (Grip::Stepping(_), None) => Grip::Held(here),
            (grip, _) => grip,
        };
        let airborne = if let (Grip::Stepping(mut step), Some(steps)) = (state.grip, settings.steps)
        {
            let (aim, _) = self.aim(state, terrain, [drawn; 2], along)?;
            let aim = Stand { place: aim, heading: heading.unwrap_or(state.heading) };
            let landed = step.advance(aim, &steps, dt);
            let stand = landed.unwrap_or_else(|| step.shown(&steps));
            state.shift = stand.place - drawn;
            state.turn = heading.map_or(state.turn, |heading| wrapped(stand.heading - heading));
            state.grip = landed.map_or(Grip::Stepping(step), |stand| Grip::Held(stand.place));
            landed.map_or(step.airborne(&steps), |_| 0.0)
        } else {
            state.airborne * (1.0 - share(settings.landing, dt))
        };
        state.airborne = if airborne < NOTHING { 0.0 } else { airborne };
        if let Grip::Held(mut place) = state.grip {
            let floor = self.support(state, terrain, place, along)? + self.ball;
            place.y = floor + (place.y - floor).max(0.0) * (1.0 - share(settings.landing, dt));
            state.shift = place - drawn;
            state.grip = Grip::Held(place);
        }
        let shown = drawn + state.shift;
        Some(shown.with_y(shown.y.max(height(terrain, shown)? + self.ball)))
    }

    /// Where a ball on its way stands on the ground at the end, and how far the ground in between
    /// rises above the straight way, metres.
    fn aim(
        &self,
        state: &FootState,
        terrain: &dyn Terrain,
        [from, to]: [Vec3; 2],
        along: Vec3,
    ) -> Option<(Vec3, f32)> {
        let to = to.with_y(self.support(state, terrain, to, along)? + self.ball);
        let mut over = 0.0f32;
        if from != to {
            for share in [0.25, 0.5, 0.75] {
                let place = from.lerp(to, share);
                let floor = self.support(state, terrain, place, along)? + self.ball;
                over = over.max(floor - place.y);
            }
        }
        Some((to, over))
    }
}
