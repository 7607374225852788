//! An interaction from its first frame to its last: time, phases, and where the character goes
//! meanwhile.

use ambulo_control::{Intent, Root};
use ambulo_rig::glam::{Vec2, Vec3};
use ambulo_rig::{Transform, wrapped};

use super::{Act, Actor, Stage, Told, Wish, standing};
use crate::curve::ease;
use crate::exact::{ahead, level};
use crate::interaction::{Action, Interaction, Walks, When, stand};
use crate::object::yawed;
use crate::surroundings::Surroundings;

/// A wish to go faster than this, metres a second, for so long, seconds, is one to leave.
const WANTS_AWAY: (f32, f32) = (0.3, 0.15);
/// Slower than this for so long, nobody pushes any more.
const WANTS_NO_MORE: (f32, f32) = (0.1, 0.3);
/// Seconds that an interaction waits for what does not come: an arm that reaches, a way that is free.
const PATIENCE: f32 = 3.0;
/// Metres a second through a door, and to where it stands in the end.
const THROUGH: f32 = 1.2;
const AWAY: f32 = 0.6;
/// Along the way: nearer to the handle than the first nobody walks on; from the second on at full
/// speed. Metres.
const HANDLE: [f32; 2] = [0.3, 0.5];
/// Metres from where it is to stand in the end: beyond a door, elsewhere.
const ARRIVED: f32 = 0.25;
const STOOD: f32 = 0.12;
/// Metres a second below which it stands.
const STANDS: f32 = 0.15;

/// A part of a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// On the way to the object.
    Enter,
    /// Hands on the handle, hips on the seat.
    Hold,
    /// And back.
    Exit,
}

/// An interaction that is being played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Acting {
    pub object: usize,
    pub which: usize,
    pub phase: Phase,
    /// Seconds of the clip.
    pub time: f32,
    /// Where the clip stands, and where the character stood when it began: (x, z) and yaw.
    pub stand: (Vec2, f32),
    pub from: (Vec2, f32),
    /// Whether its action has begun, and is over.
    pub deed: [bool; 2],
    /// The player wants to leave, and for how many seconds has.
    pub leaving: bool,
    since: f32,
    /// Seconds without progress.
    late: f32,
}

impl Acting {
    /// Where the clip's own origin is: on its way from where the character stood to where it should
    /// during the enter, and back to where it stands during the exit.
    pub fn anchor(&self, interaction: &Interaction, root: Root, time: f32) -> (Vec2, f32) {
        let clip = &interaction.clip;
        let (from, to, span) = match self.phase {
            Phase::Exit => (self.stand, (level(root.position), root.yaw), [clip.exit, clip.end]),
            _ => (self.from, self.stand, [clip.enter, clip.hold]),
        };
        let t = ease(((time - span[0]) / (span[1] - span[0])).clamp(0.0, 1.0));
        (from.0.lerp(to.0, t), from.1 + wrapped(to.1 - from.1) * t)
    }
}

/// A place on the ground at a height.
pub(super) fn placed((place, yaw): (Vec2, f32), height: f32) -> Transform {
    Transform::new(Vec3::new(place.x, height, place.y), yawed(yaw))
}

impl Actor {
    /// The clip begins, if its object is still where it was.
    pub(super) fn enter(&mut self, object: usize, which: usize, around: &dyn Surroundings) {
        let interaction = &self.moves.all()[which].interaction;
        let Some(frame) = around.frame(object, &interaction.approach.on) else {
            self.stage = Stage::Free;
            return;
        };
        let root = self.controller.root();
        let stand = interaction.approach.stand(frame);
        let from = (level(root.position), root.yaw);
        let time = interaction.clip.enter;
        self.stage = Stage::Acting(Acting {
            object,
            which,
            phase: Phase::Enter,
            time,
            stand,
            from,
            deed: [false; 2],
            leaving: false,
            since: 0.0,
            late: 0.0,
        });
        self.pace = 1.0;
        self.told = Some(Told::Enters);
    }

    /// Ends it in this frame, whatever it was about.
    pub(super) fn break_off(&mut self, around: &mut dyn Surroundings) {
        self.let_go(around);
        self.stage = Stage::Free;
        // Limbs that were led come back softly, also where the same source goes on.
        self.jumped = true;
        self.told = Some(Told::Broken);
    }

    /// Moves the clip on; what to ask of the controller meanwhile.
    pub(super) fn go_on(&mut self, dt: f32, wish: &Wish, around: &mut dyn Surroundings) -> Intent {
        let Stage::Acting(mut acting) = self.stage else { return wish.intent };
        let moves = self.moves.clone();
        let interaction = &moves.all()[acting.which].interaction;
        let root = self.controller.root();
        if self.gives_up(&mut acting, interaction, wish, dt) {
            self.stage = Stage::Acting(acting);
            self.break_off(around);
            return wish.intent;
        }
        let holds = acting.phase == Phase::Hold;
        self.tick = dt * self.pace * if holds { interaction.clip.hold_speed } else { 1.0 };
        acting.time += self.tick;
        acting.leaving |= wants_to_leave(&mut acting, interaction, wish, dt);
        self.turn_phase(&mut acting, interaction, root);
        if acting.phase == Phase::Exit && acting.time >= interaction.clip.end {
            let way = through(&acting, interaction, root, around);
            let arrived = if interaction.clip.walks == Walks::Always { ARRIVED } else { STOOD };
            if way.is_none_or(|left| left.length() < arrived || acting.late > PATIENCE) {
                self.stage = Stage::Acting(acting);
                self.let_go(around);
                self.stage = Stage::Free;
                self.told = Some(Told::Ended);
                return wish.intent;
            }
            acting.time = interaction.clip.end;
        }
        self.stage = Stage::Acting(acting);
        self.intent(&acting, interaction, wish, root, around)
    }

    /// Whether it is of no use any more: out of reach for too long, or the player goes away before
    /// anything is held.
    fn gives_up(
        &self,
        acting: &mut Acting,
        interaction: &Interaction,
        wish: &Wish,
        dt: f32,
    ) -> bool {
        let waits = self.pace < 0.2 || acting.time >= interaction.clip.end;
        acting.late = if waits { acting.late + dt } else { 0.0 };
        if self.slips {
            return true;
        }
        if acting.phase != Phase::Enter {
            return acting.late > PATIENCE && self.pace < 0.2;
        }
        let velocity = wish.intent.velocity;
        let away = velocity.length() > WANTS_AWAY.0 && velocity.dot(ahead(acting.stand.1)) < 0.0;
        acting.since = if away { acting.since + dt } else { 0.0 };
        acting.since > WANTS_AWAY.1 || acting.late > PATIENCE || wish.act == Some(Act::Leave)
    }

    fn turn_phase(&mut self, acting: &mut Acting, interaction: &Interaction, root: Root) {
        let clip = &interaction.clip;
        if acting.phase == Phase::Enter && acting.time >= clip.hold {
            acting.phase = Phase::Hold;
            (acting.since, acting.late) = (0.0, 0.0);
            self.told = Some(Told::Holds);
        }
        if acting.phase != Phase::Hold {
            return;
        }
        // Who walks about with something stands before it is put down.
        let walks = clip.walks == Walks::Hold;
        let stands = !walks || self.velocity.length() < STANDS;
        if clip.hold_repeats && !(acting.leaving && stands) {
            if acting.time >= clip.exit {
                acting.time = clip.hold + (acting.time - clip.exit) % (clip.exit - clip.hold);
                self.jumped = true;
            }
        } else if acting.leaving || acting.time >= clip.exit {
            self.jumped |= acting.time < clip.exit;
            acting.time = acting.time.max(clip.exit);
            acting.phase = Phase::Exit;
            acting.late = 0.0;
            if walks {
                acting.stand = (level(root.position), root.yaw);
            }
            self.told = Some(Told::Exits);
        }
    }

    /// What to ask of the controller.
    fn intent(
        &self,
        acting: &Acting,
        interaction: &Interaction,
        wish: &Wish,
        root: Root,
        around: &dyn Surroundings,
    ) -> Intent {
        let yaw = acting.stand.1;
        let standing = standing(ahead(yaw));
        let over = acting.time >= interaction.clip.end;
        match interaction.clip.walks {
            Walks::Always if acting.phase != Phase::Enter => {}
            Walks::Hold if acting.phase == Phase::Hold && !acting.leaving => return wish.intent,
            _ if over => {}
            _ => return standing,
        }
        if let Some(Action::Push { force, speed, .. }) = interaction.action {
            let forward = wish.intent.velocity.dot(ahead(yaw)).clamp(0.0, speed);
            let ease = around.ease(acting.object, force);
            let near = self.face(acting, interaction, around).unwrap_or(f32::INFINITY);
            let reach = interaction.approach.place[1];
            let room = ((near - reach + 0.12) / 0.08).clamp(0.0, 1.0);
            // Along the line that it stood on.
            let off = level(root.position) - acting.stand.0;
            let aside = ahead(yaw).perp() * off.dot(ahead(yaw).perp());
            let velocity = ahead(yaw) * (forward * ease * room) - aside;
            let holds = acting.phase == Phase::Hold;
            return if holds { Intent { velocity, ..standing } } else { standing };
        }
        let Some(left) = through(acting, interaction, root, around) else { return standing };
        let turned = interaction.exit.facing.zip(around.frame(acting.object, &interaction.exit.on));
        let facing = turned.map_or(yaw, |(facing, frame)| stand(frame, [0.0; 2], facing).1);
        let standing = super::standing(ahead(facing));
        let way = left.normalize_or_zero();
        let handle = around.frame(acting.object, &interaction.approach.on);
        let gap = handle.map_or(f32::INFINITY, |handle| {
            (level(handle.translation) - level(root.position)).dot(way)
        });
        let held = acting.deed == [true, false];
        let free = ((gap - HANDLE[0]) / (HANDLE[1] - HANDLE[0])).clamp(0.0, 1.0);
        let most = if over && interaction.clip.walks != Walks::Always { AWAY } else { THROUGH };
        let speed = most * if held { free } else { 1.0 };
        let speed = speed.min(2.0 * left.length());
        Intent { velocity: way * speed, ..standing }
    }

    /// How far ahead of the character the side of the object is that it stands at, metres.
    pub(super) fn face(
        &self,
        acting: &Acting,
        interaction: &Interaction,
        around: &dyn Surroundings,
    ) -> Option<f32> {
        let face = around.frame(acting.object, &interaction.approach.on)?;
        let off = level(face.translation) - level(self.controller.root().position);
        Some(off.dot(ahead(acting.stand.1)))
    }
}

/// From the character to where it stands in the end, if it walks there.
fn through(
    acting: &Acting,
    interaction: &Interaction,
    root: Root,
    around: &dyn Surroundings,
) -> Option<Vec2> {
    let exit = &interaction.exit;
    let place = exit.place?;
    let frame = around.frame(acting.object, &exit.on)?;
    let (place, _) = stand(frame, place, 0.0);
    Some(place - level(root.position))
}

/// Whether the player has wanted to leave for long enough.
fn wants_to_leave(acting: &mut Acting, interaction: &Interaction, wish: &Wish, dt: f32) -> bool {
    if acting.phase != Phase::Hold || !interaction.clip.hold_repeats {
        return false;
    }
    let speed = wish.intent.velocity.length();
    let (wants, patience) = match interaction.exit.when {
        When::PlayerMoves => (speed > WANTS_AWAY.0, WANTS_AWAY.1),
        When::PlayerStops => {
            (wish.intent.velocity.dot(ahead(acting.stand.1)) < WANTS_NO_MORE.0, WANTS_NO_MORE.1)
        }
        When::PlayerAsks | When::ClipEnds => (false, 0.0),
    };
    acting.since = if wants { acting.since + dt } else { 0.0 };
    wish.act == Some(Act::Leave) || (wants && acting.since >= patience)
}
