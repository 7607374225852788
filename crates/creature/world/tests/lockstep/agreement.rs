//! The same creature does the same in Box2D. Tolerances are a few times what was measured, which the
//! comments give.

use ambulo_body::Body;
use ambulo_lanes::Scalar;
use ambulo_world::{Lockstep, Physics, Stage, Water, World};

use crate::common::{brick, starter, two_parts};
use crate::play::{Pattern, STARTERS};

/// Ours, then Box2D's.
fn both(body: &Body, physics: &Physics) -> [Box<dyn Stage<Scalar>>; 2] {
    let ours = Lockstep::new(Scalar, &[(body, physics)]).unwrap();
    [Box::new(ours), Box::new(World::new(body, physics, 1).unwrap())]
}

fn push(stage: &mut dyn Stage<Scalar>, body: &Body, change: [f32; 2]) {
    for part in 0..body.parts().len() {
        stage.push(0, part, change.map(Into::into)).unwrap();
    }
}

fn steps(stage: &mut dyn Stage<Scalar>, count: usize) {
    (0..count).for_each(|_| stage.step().unwrap());
}

/// Place and angle of the torso.
fn torso(stage: &dyn Stage<Scalar>, body: &Body) -> [f32; 3] {
    let [x, y] = stage.centre(0, body.torso());
    [x, y, stage.turned(0, body.torso())].map(|value| value.value())
}

/// Half a second in the air: within 0.002 mm.
#[test]
fn it_falls_alike() {
    for name in STARTERS {
        let body = starter(name);
        let [ours, theirs] = both(&body, &Physics::default()).map(|mut stage| {
            push(&mut *stage, &body, [1.0, 5.0]);
            steps(&mut *stage, 30);
            torso(&*stage, &body)
        });
        assert!((ours[0] - theirs[0]).abs() < 1e-5 && (ours[1] - theirs[1]).abs() < 1e-5, "{name}");
        assert!((ours[2] - theirs[2]).abs() < 1e-4, "{name}");
    }
}

/// A light rod that hangs beside a heavy block: the period within 1e-5 of Box2D's and 1e-4 of the
/// formula's, and ten seconds later as wide as in the beginning.
#[test]
fn it_swings_alike() {
    let (length, angle) = (0.8f32, 0.3f32);
    let middle = [5.0 + 0.5 * length * angle.sin(), 3.0 - 0.5 * length * angle.cos()];
    let rod = format!(r#"{{"box": {{"width": 0.05, "height": {length}}}}}"#);
    let body = two_parts(
        r#""shape": {"box": {"width": 6.0, "height": 6.0}}, "position": [0, 3]"#,
        &format!(r#""shape": {rod}, "position": {middle:?}, "angle": {angle}"#),
        r#""anchor": [5.0, 3.0], "limits": [-3, 3], "torque": 1, "speed": 1"#,
    );
    let limp = Physics { torque_scale: 0.0, ..Physics::default() };
    let [ours, theirs] = both(&body, &limp).map(|mut stage| {
        let (mut crossings, mut last, mut widest) = (Vec::new(), angle, 0.0f32);
        for step in 1..=600 {
            stage.step().unwrap();
            let now = angle + stage.turned(0, 1).value();
            if (last < 0.0) != (now < 0.0) {
                crossings.push((step as f32 - now / (now - last)) / 60.0);
            }
            widest = if step > 450 { widest.max(now.abs()) } else { 0.0 };
            last = now;
        }
        assert!((widest - angle).abs() < 0.003, "{widest}");
        2.0 * (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f32
    });
    // √(I / (m g d)), with the correction for a wide swing.
    let inertia = (4.0 * length * length + 0.05 * 0.05) / 12.0;
    let wide = 1.0 + angle * angle / 16.0;
    let expected = std::f32::consts::TAU * (inertia / (9.81 * 0.5 * length)).sqrt() * wide;
    assert!((ours / theirs - 1.0).abs() < 1e-3, "{ours} s, in Box2D {theirs} s");
    assert!((ours / expected - 1.0).abs() < 1e-3, "{ours} s for {expected} s");
}

/// The way to a stop: within 2e-4 of Box2D's and 2 % of v² / (2 µ g).
#[test]
fn it_slides_alike() {
    for (friction, scale, speed) in [(0.8, 1.0, 2.0), (0.8, 0.5, 3.0), (0.2, 1.0, 2.0)] {
        let body = brick(friction);
        let physics = Physics { friction_scale: scale, ..Physics::default() };
        let [ours, theirs] = both(&body, &physics).map(|mut stage| {
            steps(&mut *stage, 30);
            let start = torso(&*stage, &body)[0];
            push(&mut *stage, &body, [speed, 0.0]);
            steps(&mut *stage, 240);
            torso(&*stage, &body)[0] - start
        });
        let expected = speed * speed / (2.0 * scale * (friction * 0.8f32).sqrt() * 9.81);
        assert!((ours / theirs - 1.0).abs() < 0.005, "{ours} m, in Box2D {theirs} m");
        assert!((ours / expected - 1.0).abs() < 0.03, "{ours} m for {expected} m");
    }
}

/// On its feet, motors at 0, for three seconds: within 0.5 mm and 0.001 rad. All starters stand there.
#[test]
fn it_stands_alike() {
    for name in STARTERS {
        let body = starter(name);
        let [ours, theirs] = both(&body, &Physics::default()).map(|mut stage| {
            steps(&mut *stage, 180);
            torso(&*stage, &body)
        });
        assert!((theirs[1] - body.standing_height()).abs() < 0.03, "{name} does not stand");
        let [x, y, angle] = [0, 1, 2].map(|i| (ours[i] - theirs[i]).abs());
        assert!(x < 0.003 && y < 0.002 && angle < 0.005, "{name}: {x} m, {y} m, {angle} rad");
    }
}

/// From half a metre, motors at 0: as high at first to 0.5 mm, and at rest to 0.3 mm; the frog and the
/// raptor, whose ankles give in, to 10 mm and 0.03 rad.
#[test]
fn it_lands_alike() {
    for name in STARTERS {
        let body = starter(name);
        let [ours, theirs] = both(&body, &Physics::default()).map(|mut stage| {
            push(&mut *stage, &body, [0.0, (2.0f32 * 9.81 * 0.5).sqrt()]);
            let mut highest = 0.0f32;
            for _ in 0..240 {
                stage.step().unwrap();
                highest = highest.max(torso(&*stage, &body)[1]);
            }
            let [_, y, angle] = torso(&*stage, &body);
            [highest, y, angle]
        });
        let [highest, y, angle] = [0, 1, 2].map(|i| (ours[i] - theirs[i]).abs());
        let [good, turned] = match name {
            "frog" | "raptor" => [0.02, 0.05],
            _ => [0.002, 0.002],
        };
        assert!(highest < 0.001, "{name}: {highest} m at the highest");
        assert!(y < good && angle < turned, "{name}: {y} m, {angle} rad at rest");
    }
}

/// The first third of a second of random movement at up to 4.5 rad/s, before chance takes over: 3 to
/// 18 mm of 20 to 180 mm and up to 0.035 rad, in the mean of twelve; a third of that in other physics,
/// and in water, where nothing is hit, 0.5 mm.
#[test]
fn it_moves_alike() {
    let other = Physics {
        gravity: 7.0,
        rate: 75.0,
        substeps: 3,
        friction_scale: 0.5,
        mass_scale: 2.0,
        torque_scale: 0.7,
        ..Physics::default()
    };
    let water = Physics { water: Some(Water::default()), ..Physics::default() };
    let all =
        |name: &'static str| [Physics::default(), other, water].map(|physics| (name, physics));
    for (name, physics) in STARTERS.into_iter().flat_map(all) {
        let body = starter(name);
        let (mut place, mut turn) = (0.0, 0.0);
        for seed in 0..12 {
            let [ours, theirs] = both(&body, &physics).map(|mut stage| {
                for step in 0..20 {
                    for joint in 0..body.joints().len() {
                        let most = 0.5f32.min(4.5 / body.joints()[joint].speed);
                        let speed = most * Pattern::Sine.speed(&body, seed, step, joint);
                        stage.set_motor(0, joint, speed.into()).unwrap();
                    }
                    stage.step().unwrap();
                }
                torso(&*stage, &body)
            });
            place += (ours[0] - theirs[0]).hypot(ours[1] - theirs[1]) / 12.0;
            turn += (ours[2] - theirs[2]).abs() / 12.0;
        }
        let good = if physics.water.is_some() { [0.002, 0.005] } else { [0.03, 0.05] };
        assert!(place < good[0] && turn < good[1], "{name}: {place} m, {turn} rad");
    }
}

/// Against a limit a motor gives all that it has, and as much as it does in Box2D.
#[test]
fn it_strains_alike() {
    for torque_scale in [0.5, 1.0] {
        let body = starter("tetrapod1");
        let physics = Physics { torque_scale, gravity: 0.0, ..Physics::default() };
        for mut stage in both(&body, &physics) {
            push(&mut *stage, &body, [0.0, 3.0]);
            for joint in 0..body.joints().len() {
                stage.set_motor(0, joint, 3.0.into()).unwrap();
            }
            steps(&mut *stage, 60);
            for (index, joint) in body.joints().iter().enumerate() {
                let torque = stage.motor_torque(0, index).unwrap().value();
                let over = stage.joint_angle(0, index).value() - joint.limits[1];
                assert!(
                    (torque / (torque_scale * joint.torque) - 1.0).abs() < 0.01,
                    "{torque} N m"
                );
                assert!(over.abs() < 0.05, "{over} rad beyond its limit");
            }
        }
    }
}
