//! Bodies that evolve stay bodies, within their bounds.

use ambulo_body::{Body, Morphology, Shape};
use proptest::prelude::*;

fn starter(name: &str) -> Body {
    let path = format!("{}/../../../starters/creatures/{name}.json", env!("CARGO_MANIFEST_DIR"));
    Body::parse(&std::fs::read_to_string(path).unwrap()).unwrap()
}

const ALL: [&str; 9] = [
    "apod",
    "biped1",
    "biped2",
    "tetrapod1",
    "tetrapod2",
    "decapod1",
    "decapod2",
    "raptor",
    "frog",
];

/// How long each part is from where it hangs to its centre, metres.
fn arm(body: &Body, part: usize) -> f32 {
    let (_, joint) = body.above(part).unwrap();
    let ([x, y], [ax, ay]) = (body.parts()[part].position, body.joints()[joint].anchor);
    (x - ax).hypot(y - ay)
}

#[test]
fn genes_of_nothing_leave_the_file_as_it_is() {
    for name in ALL {
        let body = starter(name);
        let morphology = Morphology::default();
        let same = morphology.apply(&body, &vec![0.0; morphology.genes(&body)]).unwrap();
        assert_eq!(same.hash(), body.hash(), "{name}");
    }
}

#[test]
fn what_does_not_evolve_has_no_genes_and_paired_parts_share_theirs() {
    let body = starter("tetrapod2");
    let still = [1.0; 2];
    let none = Morphology { size: still, strength: still, density: still };
    assert_eq!(none.genes(&body), 0);
    // Torso, and four legs of two segments in two pairs.
    assert_eq!(body.pairs().len(), 4);
    let size = Morphology { strength: still, density: still, ..Morphology::default() };
    assert_eq!(size.genes(&body), 5);
    // The torso has no motor.
    let strength = Morphology { size: still, density: still, ..Morphology::default() };
    assert_eq!(strength.genes(&body), 4);
    assert_eq!(Morphology::default().genes(&body), 14);
    let genes: Vec<_> = (0..14).map(|gene| gene as f32 / 7.0 - 1.0).collect();
    let changed = Morphology::default().apply(&body, &genes).unwrap();
    for &[left, right] in changed.pairs() {
        let [left, right] = [left, right].map(|joint| changed.driven()[joint]);
        assert_eq!(changed.joints()[left].torque, changed.joints()[right].torque);
        let [left, right] = [left, right].map(|joint| changed.ends(joint).1);
        assert_eq!(changed.parts()[left].density, changed.parts()[right].density);
        assert_eq!(changed.parts()[left].shape, changed.parts()[right].shape);
    }
}

/// A longer thigh carries its shank along; the shank keeps its size and hangs where it hung.
#[test]
fn what_hangs_on_a_part_moves_along() {
    let body = starter("biped2");
    let still = [1.0; 2];
    let size = Morphology { size: [0.5, 2.0], strength: still, density: still };
    let leg = body.legs()[0].parts.clone();
    let (thigh, shank) = (leg[0], leg[1]);
    // The genes are in the order of the parts' first of each pair.
    let count = size.genes(&body);
    let grows = (0..count).find(|&gene| {
        let genes: Vec<_> = (0..count).map(|g| if g == gene { 1e3 } else { 0.0 }).collect();
        let one = size.apply(&body, &genes).unwrap();
        one.parts()[thigh].shape != body.parts()[thigh].shape
    });
    let genes: Vec<_> = (0..count).map(|g| if Some(g) == grows { 1e3 } else { 0.0 }).collect();
    let longer = size.apply(&body, &genes).unwrap();
    assert!((arm(&longer, thigh) - 2.0 * arm(&body, thigh)).abs() < 1e-5);
    assert!((arm(&longer, shank) - arm(&body, shank)).abs() < 1e-5);
    assert_eq!(longer.parts()[shank].shape, body.parts()[shank].shape);
    let (hip, knee) = (body.above(thigh).unwrap().1, body.above(shank).unwrap().1);
    assert_eq!(longer.joints()[hip].anchor, body.joints()[hip].anchor);
    let far = |body: &Body| {
        let ([hx, hy], [kx, ky]) = (body.joints()[hip].anchor, body.joints()[knee].anchor);
        (hx - kx).hypot(hy - ky)
    };
    assert!((far(&longer) - 2.0 * far(&body)).abs() < 1e-5);
    assert_eq!(longer.parts()[body.torso()], body.parts()[body.torso()]);
}

#[test]
fn bounds_that_cannot_be_are_refused_by_name() {
    let body = starter("frog");
    let told = |morphology: Morphology| morphology.check(&body).unwrap_err().to_string();
    let base = Morphology::default();
    assert!(told(Morphology { size: [0.1, 1.0], ..base }).starts_with("size: [0.1, 1]"));
    assert!(told(Morphology { strength: [1.1, 1.2], ..base }).starts_with("strength:"));
    assert!(told(Morphology { density: [0.9, f32::NAN], ..base }).starts_with("density:"));
    // A part at the least size that there is cannot shrink.
    let mut description = body.description().clone();
    description.parts[0].shape = Shape::Circle { radius: 0.01 };
    let small = Body::new(description).unwrap();
    let told = base.check(&small).unwrap_err().to_string();
    assert!(told.contains("so small or weak") && told.contains("$.parts[0].shape"), "{told}");
}

proptest! {
    /// Whatever the genes, what evolves stays within the bounds, and reads back as it was written.
    #[test]
    fn any_genome_is_a_body_within_the_bounds(
        which in 0..ALL.len(),
        genes in prop::collection::vec(-50.0..50.0_f32, 120),
    ) {
        let (body, morphology) = (starter(ALL[which]), Morphology::default());
        morphology.check(&body).unwrap();
        let made = morphology.apply(&body, &genes[..morphology.genes(&body)]).unwrap();
        let within = |now: f32, before: f32, [least, most]: [f32; 2]| {
            let factor = now / before;
            factor >= least * (1.0 - 1e-5) && factor <= most * (1.0 + 1e-5)
        };
        for (now, before) in made.parts().iter().zip(body.parts()) {
            prop_assert!(within(now.density, before.density, morphology.density));
            prop_assert!(within(now.shape.area().sqrt(), before.shape.area().sqrt(), morphology.size));
        }
        for (now, before) in made.joints().iter().zip(body.joints()) {
            prop_assert!(within(now.torque, before.torque, morphology.strength));
            prop_assert_eq!(now.limits, before.limits);
        }
        prop_assert_eq!(Body::parse(&made.to_json()).unwrap().hash(), made.hash());
    }
}
