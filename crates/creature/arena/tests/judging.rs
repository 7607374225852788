//! When a motion is usable: each criterion on motions made by hand, and every task on every creature.

mod common;

use ambulo_arena::{Arena, Judgement, Rollout, TASKS};
use common::{CREATURES, first, short};
use std::f32::consts::TAU;

const STEPS: usize = 2000;
const DT: f32 = 1.0 / 60.0;

/// A trot of Tetrapod 2: half a second a cycle, two body lengths a second, all by rule.
struct Made {
    arena: Arena,
    rollout: Rollout,
}

impl Made {
    fn trot() -> Self {
        let arena = short("tetrapod2", "run", 2000, 3);
        let body = arena.body();
        let (parts, joints) = (body.parts().len(), body.driven().len());
        let mut rollout = Rollout {
            body: body.clone().into(),
            dt: DT,
            poses: vec![0.0; (STEPS + 1) * parts * 3],
            touching: vec![false; (STEPS + 1) * parts],
            angles: vec![],
            commands: vec![0.5; STEPS * joints],
            torques: vec![20.0; STEPS * joints],
            torso: vec![],
            tilt: vec![0.0; STEPS + 1],
            ground: vec![[-1000.0, 0.0], [1000.0, 0.0]],
            hash: 0,
            lost: false,
        };
        let (speed, height) = (2.0 * body.length(), body.standing_height());
        // Far and near legs of a pair half a cycle apart.
        let legs = body.legs();
        let far = |leg: usize| body.parts()[legs[leg].parts[0]].name.ends_with("far");
        let late = |leg: usize| if far(leg) { 0.0 } else { 0.5 };
        let leg_of =
            |joint: usize| legs.iter().position(|leg| leg.joints.contains(&joint)).unwrap();
        for step in 0..=STEPS {
            let time = step as f32 * DT;
            rollout.torso.push([speed * time, height]);
            let cycle = |leg: usize| (time / 0.5 + late(leg)).fract();
            for joint in 0..joints {
                rollout.angles.push(0.3 * (TAU * cycle(leg_of(joint))).sin());
            }
            for (index, leg) in body.legs().iter().enumerate() {
                rollout.touching[step * parts + leg.foot] = cycle(index) < 0.6;
            }
        }
        Self { arena, rollout }
    }

    fn judged(&self) -> Judgement {
        self.arena.judge(&self.rollout)
    }

    /// The only reason, or a panic that tells all.
    fn reason(&self) -> String {
        let judged = self.judged();
        assert!(!judged.usable);
        assert_eq!(judged.reasons.len(), 1, "{:?}", judged.reasons);
        judged.reasons[0].clone()
    }

    fn parts(&self) -> usize {
        self.arena.body().parts().len()
    }
}

#[test]
fn a_trot_is_usable_and_its_figures_are_those_it_was_made_with() {
    let judged = Made::trot().judged();
    assert!(judged.usable, "{:?}", judged.reasons);
    let near =
        |got: f64, expected: f64, by: f64| assert!((got - expected).abs() < by, "{got} {expected}");
    near(judged.speed_bl_s, 2.0, 1e-3);
    near(judged.slowest_bl_s, 2.0, 1e-3);
    near(judged.upright, 1.0, 1e-9);
    near(judged.torso_contact, 0.0, 1e-9);
    near(judged.period_s.unwrap(), 0.5, 0.02);
    assert!(judged.regularity.unwrap() > 0.98);
    assert!(judged.symmetry.unwrap() > 0.95);
    assert_eq!((judged.legs_used, judged.legs), (4, 4));
    assert_eq!(judged.saturation, 0.0);
    for foot in &judged.feet {
        near(foot.duty, 0.6, 0.02);
        // Landing half a cycle after the first leg's foot, or with it.
        let phase = foot.phase.unwrap();
        let expected = if foot.leg.ends_with("far") == judged.feet[0].leg.ends_with("far") {
            0.0
        } else {
            0.5
        };
        let off = (phase - expected).rem_euclid(1.0);
        assert!(!(0.05..=0.95).contains(&off), "{} {phase}", foot.leg);
    }
    // 8 joints, 20 N·m, each 1.2 rad a cycle of half a second.
    let body = Made::trot().arena.body().clone();
    let power = 8.0 * 20.0 * 1.2 / 0.5;
    let speed = 2.0 * f64::from(body.length());
    near(judged.cost_of_transport.unwrap(), power / (f64::from(body.mass()) * 9.81 * speed), 0.03);
}

#[test]
fn slow_or_stalling_is_not() {
    let mut slow = Made::trot();
    slow.rollout.torso.iter_mut().for_each(|at| at[0] *= 0.14);
    assert!(slow.reason().starts_with("slow: 0.28 body lengths"), "{}", slow.reason());
    // Fast on the whole, but it stands for a part of the last quarter.
    let mut stalls = Made::trot();
    for step in 1500..=1630 {
        stalls.rollout.torso[step][0] = stalls.rollout.torso[1500][0];
    }
    assert!(stalls.reason().starts_with("it stalls: "), "{}", stalls.reason());
    // What was earlier does not count.
    let mut late = Made::trot();
    for step in 0..=800 {
        late.rollout.torso[step][0] = late.rollout.torso[800][0];
    }
    assert!(late.judged().usable);
}

#[test]
fn tilted_or_lying_is_not() {
    let mut tilted = Made::trot();
    tilted.rollout.tilt[300..410].fill(-1.2);
    assert!(
        tilted.reason().starts_with("upright in 94 %")
            || tilted.reason().starts_with("upright in 95 %"),
        "{}",
        tilted.reason()
    );
    tilted.rollout.tilt[300..340].fill(0.9);
    assert!(tilted.judged().usable);
    let mut lying = Made::trot();
    let (parts, torso) = (lying.parts(), lying.arena.body().torso());
    (1..=120).for_each(|step| lying.rollout.touching[step * parts + torso] = true);
    assert!(lying.reason().starts_with("its torso is on the ground in 6 %"), "{}", lying.reason());
}

#[test]
fn an_idle_leg_is_named() {
    let leg = |made: &Made, index: usize| made.arena.body().legs()[index].clone();
    let name = |made: &Made, index: usize| {
        made.arena.body().parts()[leg(made, index).parts[0]].name.clone()
    };
    // Its joints hardly move.
    let mut stiff = Made::trot();
    let joints = stiff.arena.body().driven().len();
    for joint in leg(&stiff, 2).joints {
        stiff.rollout.angles.iter_mut().skip(joint).step_by(joints).for_each(|a| *a *= 0.2);
    }
    assert_eq!(stiff.reason(), format!("idle: {}", name(&stiff, 2)));
    // It is never on the ground, or always.
    for on in [false, true] {
        let mut held = Made::trot();
        let (parts, foot) = (held.parts(), leg(&held, 1).foot);
        (0..=STEPS).for_each(|step| held.rollout.touching[step * parts + foot] = on);
        assert_eq!(held.reason(), format!("idle: {}", name(&held, 1)));
        assert_eq!(held.judged().legs_used, 3);
    }
}

/// Without legs it may lie on its torso and roll, but no joint may be idle.
#[test]
fn a_creature_without_legs_is_asked_for_all_joints_and_not_for_posture() {
    let mut rolls = Made::trot();
    rolls.arena = short("apod", "run", 2000, 3);
    rolls.rollout.body = rolls.arena.body().clone().into();
    let body = rolls.arena.body();
    let (parts, joints) = (body.parts().len(), body.driven().len());
    let wave = |step: usize, joint: usize| 0.3 * (step as f32 * 0.2 + joint as f32).sin();
    let all = |still: usize| {
        let of = move |step| {
            (0..joints).map(move |joint| if joint == still { 0.0 } else { wave(step, joint) })
        };
        (0..=STEPS).flat_map(of).collect()
    };
    rolls.rollout.touching = vec![true; (STEPS + 1) * parts];
    rolls.rollout.tilt.fill(2.0);
    rolls.rollout.commands = vec![0.5; STEPS * joints];
    rolls.rollout.torques = vec![20.0; STEPS * joints];
    rolls.rollout.angles = all(joints);
    assert!(rolls.judged().usable, "{:?}", rolls.judged().reasons);
    rolls.rollout.angles = all(2);
    assert_eq!(rolls.reason(), "idle: front 3");
}

#[test]
fn a_motion_that_was_lost_is_not() {
    let mut lost = Made::trot();
    lost.rollout.lost = true;
    assert!(lost.reason().contains("not a number"));
}

/// A jump of Tetrapod 2 by rule: two thirds of a second in the air, up by `rise` metres.
fn jump(rise: f32) -> Made {
    let made = Made::trot();
    let arena = short("tetrapod2", "jump", 500, 3);
    let body = arena.body();
    let (parts, height) = (body.parts().len(), body.standing_height());
    let mut rollout = made.rollout;
    for step in 0..=STEPS {
        let air = ((step as f32 * DT - 1.0) / 0.66).clamp(0.0, 1.0);
        rollout.torso[step] = [0.0, height + rise * 4.0 * air * (1.0 - air)];
        for part in 0..parts {
            let foot = body.legs().iter().any(|leg| leg.foot == part);
            rollout.touching[step * parts + part] = foot && (air == 0.0 || air == 1.0);
        }
    }
    Made { arena, rollout }
}

#[test]
fn a_jump_with_a_landing_is_usable() {
    let judged = jump(0.5).judged();
    assert!(judged.usable, "{:?}", judged.reasons);
    assert!((judged.gain.unwrap() - 0.5).abs() < 0.01);
    let half = 0.5 * f64::from(jump(0.5).arena.body().standing_height());
    assert_eq!(judged.gain_needed, Some(half));
}

#[test]
fn low_stretching_tilted_or_fallen_jumps_are_not() {
    assert!(jump(0.3).reason().starts_with("low: the torso rose 0.30 m"));
    // One foot stays down: a stretch, not a jump.
    let mut stretch = jump(0.5);
    let (parts, foot) = (stretch.parts(), stretch.arena.body().legs()[3].foot);
    (0..=STEPS).for_each(|step| stretch.rollout.touching[step * parts + foot] = true);
    assert_eq!(stretch.reason(), "its feet never left the ground all at once");
    let mut flip = jump(0.5);
    flip.rollout.tilt[70..100].fill(1.6);
    assert_eq!(flip.reason(), "at the top it is tilted by 1.6 rad");
    let mut fallen = jump(0.5);
    fallen.rollout.tilt[1990] = -2.0;
    assert_eq!(fallen.reason(), "at the end it is tilted by 2.0 rad");
    let mut crashed = jump(0.5);
    let torso = crashed.arena.body().torso();
    crashed.rollout.touching[1995 * parts + torso] = true;
    assert_eq!(crashed.reason(), "at the end its torso is on the ground");
    let mut sunk = jump(0.5);
    let low = 0.5 * sunk.arena.body().standing_height();
    sunk.rollout.torso[1985..].iter_mut().for_each(|at| at[1] = low);
    assert!(sunk.reason().starts_with("at the end it does not stand"));
    let mut floating = jump(0.5);
    floating.rollout.touching[1900 * parts..].fill(false);
    assert_eq!(floating.reason(), "at the end no foot is on the ground");
}

/// Register a task once, and it is tried on every creature.
#[test]
fn every_task_is_judged_on_every_creature() {
    for task in TASKS {
        assert!(!task.about().is_empty() && task.steps() > 0 && !task.weights().is_empty());
        for name in CREATURES {
            let arena = short(name, task.name(), 60, 3);
            let still = arena.record(&vec![0.0; arena.genes()], 240).unwrap();
            let judged = arena.judge(&still);
            // Who holds still does nothing, unless that is what is asked for.
            let still_is_right = task.name() == "keep_upright";
            assert_eq!(judged.usable, still_is_right, "{name} {}: {judged:?}", task.name());
            assert_eq!(judged.usable, judged.reasons.is_empty());
            assert!(judged.upright > 0.99, "{name} stands: {judged:?}");
            let genome = &first(&arena)[1];
            let first = arena.record(genome, 120).unwrap();
            assert_eq!(first, arena.record(genome, 120).unwrap(), "{name}: the same every time");
            let judged = arena.judge(&first);
            assert!(judged.distance.is_finite() && judged.speed_bl_s.is_finite());
        }
    }
}
