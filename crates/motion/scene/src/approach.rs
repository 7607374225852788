//! The way to where an interaction begins.
//!
//! The character's own controller walks there: a [`Walk`] only says what to wish for, step by step, and
//! gives up when somebody else wants something else or when the way is blocked. Nothing is moved but
//! by the character's own steps; what is missing when it has arrived, [`Approach`] allows.

use ambulo_control::{Gait as Pace, Intent, Root};
use ambulo_rig::glam::Vec2;
use ambulo_rig::wrapped;

use crate::exact::{ahead, level};
use crate::{Approach, Gait};

/// Metres a second for each metre that is left: slow enough that who arrives does not overshoot.
const EASE: f32 = 2.0;
/// Slower than this it would stand still, metres a second.
const SLOWEST: f32 = 0.12;
/// From here on, metres, it turns to the facing, and has all of it at the second.
const TURN: [f32; 2] = [1.2, 0.5];
/// Seconds without getting nearer after which the way is blocked.
const PATIENCE: f32 = 2.5;
/// Seconds without getting nearer after which who is nearly there takes another run, how near that is,
/// from how far before the place, metres, for how long at most, seconds, and how often.
const AGAIN: f32 = 1.0;
const NEARLY: f32 = 1.0;
const RUN: (f32, f32) = (0.7, 2.0);
const TRIES: u8 = 3;
/// What counts as nearer: metres, radians.
const NEARER: [f32; 2] = [0.03, 0.05];
/// A wish to go faster than this, metres a second, for so long, seconds, and by more than a right angle
/// elsewhere, leads away.
const AWAY: [f32; 2] = [0.3, 0.2];

/// How a walk goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Going {
    /// What to ask the controller for.
    On(Intent),
    /// It stands where the interaction begins.
    There,
    /// It does not get there; the player has the character again.
    GaveUp(Why),
}

/// Why a walk was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// The player wants to go elsewhere.
    LedAway,
    /// It did not get nearer for 2.5 s.
    Blocked,
    /// Where it is, is not a number.
    Lost,
}

/// A walk to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    place: Vec2,
    yaw: f32,
    distance: f32,
    angle: f32,
    pace: Pace,
    speed: f32,
    /// The nearest that it has been, metres and radians, and for how long it has not been nearer.
    nearest: [f32; 2],
    stuck: f32,
    away: f32,
    /// Seconds that are left to step back before another run, and how many are left.
    back: f32,
    tries: u8,
}

impl Walk {
    /// To a place (x, z) and a yaw in the world, as [`Approach::stand`] gives them, as near and as
    /// fast as the approach allows: it walks if it may.
    pub fn new(approach: &Approach, (place, yaw): (Vec2, f32)) -> Self {
        let may = |gait: Gait| approach.gaits.contains(&gait);
        let (pace, speed) = if may(Gait::Walk) || may(Gait::Stand) {
            (Pace::Walk, 1.3)
        } else if may(Gait::Jog) {
            (Pace::Jog, 2.6)
        } else if may(Gait::Run) {
            (Pace::Run, 4.0)
        } else {
            (Pace::Crouch, 0.8)
        };
        Self {
            place,
            yaw,
            distance: approach.distance,
            angle: approach.angle,
            pace,
            speed,
            nearest: [f32::INFINITY; 2],
            stuck: 0.0,
            away: 0.0,
            back: 0.0,
            tries: TRIES,
        }
    }

    /// What to do in the next `dt` seconds, the character being at `root` and the player wishing for
    /// that velocity (x, z).
    pub fn step(&mut self, root: Root, wish: Vec2, dt: f32) -> Going {
        let to = self.place - level(root.position);
        let left = [to.length(), wrapped(self.yaw - root.yaw).abs()];
        if !(left[0].is_finite() && left[1].is_finite()) {
            return Going::GaveUp(Why::Lost);
        }
        if left[0] <= self.distance && left[1] <= self.angle {
            return Going::There;
        }
        let leads = wish.length() > AWAY[0] && wish.dot(to) < 0.0;
        self.away = if leads { self.away + dt } else { 0.0 };
        if self.away >= AWAY[1] {
            return Going::GaveUp(Why::LedAway);
        }
        // Who turns about steps off the place and comes back: either is getting on.
        self.stuck += dt;
        for what in 0..2 {
            if left[what] < self.nearest[what] - NEARER[what] {
                (self.nearest[what], self.stuck) = (left[what], 0.0);
            }
        }
        if self.stuck >= AGAIN && self.tries > 0 && left[0] < NEARLY {
            (self.tries, self.back) = (self.tries - 1, RUN.1);
            (self.stuck, self.nearest) = (0.0, [f32::INFINITY; 2]);
        }
        if self.stuck >= PATIENCE {
            return Going::GaveUp(Why::Blocked);
        }
        let ahead = ahead(self.yaw);
        if self.back > 0.0 {
            // From there it comes straight on, facing as it should.
            self.back -= dt;
            let start = to - ahead * RUN.0;
            if start.length() > 0.3 * RUN.0 {
                let velocity = start.normalize_or_zero() * self.speed.min(0.8);
                let (facing, gait) = (Some(ahead), self.pace);
                return Going::On(Intent { velocity, facing, strafe: 1.0, gait });
            }
            (self.back, self.nearest) = (0.0, [f32::INFINITY; 2]);
        }
        // Halfway into what is allowed it stands; so it does not stop at the edge of it.
        let speed = (EASE * left[0]).clamp(SLOWEST, self.speed);
        let walks = left[0] > 0.5 * self.distance;
        let share = (TURN[0] - left[0]) / (TURN[0] - TURN[1]);
        Going::On(Intent {
            velocity: if walks { to.normalize_or_zero() * speed } else { Vec2::ZERO },
            facing: Some(ahead),
            strafe: share.clamp(0.0, 1.0),
            gait: self.pace,
        })
    }
}
