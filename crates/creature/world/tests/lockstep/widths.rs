//! An individual does the same in every width, in every lane and in every company.

use ambulo_body::Body;
use ambulo_lanes::Width;
use ambulo_world::{Ground, Physics, Water};

use crate::common::starter;
use crate::play::{Pattern, Play, UNEVEN, moved, on, scaled};

/// Sixteen of a kind that differ in size and physics.
fn company(name: &str, ground: Ground, wet: bool) -> Vec<(Body, Physics)> {
    let one = |who: usize| {
        let vary = |least: f32, most: f32, by: usize| {
            least + (most - least) * (who * by % 16) as f32 / 15.0
        };
        let physics = Physics {
            gravity: vary(3.0, 15.0, 3),
            rate: vary(40.0, 120.0, 5),
            ground_friction: vary(0.1, 1.0, 7),
            friction_scale: vary(0.5, 1.5, 9),
            mass_scale: vary(0.5, 2.0, 11),
            torque_scale: vary(0.2, 3.0, 13),
            water: wet.then(|| Water { density: vary(10.0, 90.0, 3), drag: vary(0.5, 2.0, 5) }),
            ..on(ground)
        };
        // Where the ground is of its kind.
        (moved(&scaled(&starter(name), vary(0.7, 1.4, 1)), 5.0), physics)
    };
    (0..16).map(one).collect()
}

/// Paths of some of them, each with motors of its own.
fn paths(company: &[(Body, Physics)], who: &[usize], width: Width) -> Vec<u64> {
    let motors = |i: usize, step: usize, joint: usize| {
        Pattern::Sine.speed(&company[who[i]].0, who[i], step, joint)
    };
    let bodies: Vec<_> = who.iter().map(|&who| (&company[who].0, &company[who].1)).collect();
    let play = Play { who: &bodies, motors: &motors, throws: None, steps: 60, hashes: true };
    play.run(width).iter().map(|seen| seen.hash).collect()
}

#[test]
fn every_width_and_ground_gives_the_same_bits() {
    let all: Vec<_> = (0..16).collect();
    let dry = [Ground::Flat].into_iter().chain(UNEVEN).map(|ground| (ground, false));
    for (ground, wet) in dry.chain([(Ground::Flat, true)]) {
        for name in ["apod", "tetrapod2", "frog"] {
            let company = company(name, ground, wet);
            let expected = paths(&company, &all, Width::One);
            for width in Width::available() {
                assert_eq!(paths(&company, &all, width), expected, "{name} {ground:?} {width:?}");
            }
        }
    }
}

#[test]
fn company_and_place_do_not_matter() {
    let width = Width::widest();
    for ground in [Ground::Flat, UNEVEN[5]] {
        let company = company("raptor", ground, false);
        let expected = paths(&company, &(0..16).collect::<Vec<_>>(), width);
        for who in [vec![3], vec![3, 3], vec![9, 0, 3], (0..16).rev().collect::<Vec<_>>()] {
            let got = paths(&company, &who, width);
            let same: Vec<_> = who.iter().map(|&who| expected[who]).collect();
            assert_eq!(got, same, "{ground:?}: {who:?} of 16");
        }
    }
}

/// Who is no longer at any place at all harms nobody else.
#[test]
fn one_that_flies_apart_flies_apart_alone() {
    for ground in [Ground::Flat, UNEVEN[1]] {
        let (body, physics) = (moved(&starter("tetrapod2"), 5.0), on(ground));
        let path = |lost: Option<usize>| {
            let throws = |who: usize, _: usize| match lost {
                Some(lost) if lost == who => [f32::MAX, -f32::MAX, f32::MAX],
                _ => [0.1 * who as f32, 1.0, 0.0],
            };
            let motors = |who: usize, step: usize, joint: usize| {
                Pattern::Abrupt.speed(&body, who, step, joint)
            };
            let who = [(&body, &physics); 4];
            let throws: Option<&dyn Fn(usize, usize) -> [f32; 3]> = Some(&throws);
            let seen = |hashes| Play { who: &who, motors: &motors, throws, steps: 60, hashes }.go();
            (seen(true), seen(false))
        };
        let (alone, beside) = (path(None), path(Some(1)));
        assert!(!beside.1[1].energy[60].is_finite(), "{ground:?}");
        for who in [0, 2, 3] {
            assert_eq!(alone.0[who].hash, beside.0[who].hash, "{ground:?}: {who} of 4");
        }
    }
}
