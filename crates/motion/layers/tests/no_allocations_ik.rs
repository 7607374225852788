//! Hands, spines, hips, heads and feet allocate nothing while a character moves. Alone in its
//! program, since it counts what the whole program allocates.

#[path = "ik/walk.rs"]
mod walk;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use ambulo_layers::{
    Chain, ChainSettings, FeetState, FootPlacement, FootSettings, Ground, Hips, HipsSettings,
    HipsState, JointLimit, Limb, LimbSettings, LookAt, LookJoint, LookSettings, Pole, Reach,
    StepSettings, Want,
};
use ambulo_rig::HeightField;
use ambulo_rig::glam::Vec3;
use walk::{ANKLES, Walker};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u32> = const { Cell::new(0) };
}

fn count() {
    ALLOCATIONS.with(|count| count.set(count.get() + 1));
}

// SAFETY: everything is handed on to the system's allocator as it came.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn nothing_is_allocated_while_a_character_moves() {
    let before = ALLOCATIONS.get();
    drop(std::hint::black_box(vec![1]));
    assert_eq!(ALLOCATIONS.get(), before + 1, "the counter counts");

    let walker = Walker::new(0.3, [0.02, 0.0]);
    let (skeleton, stance) = (&walker.skeleton, walker.stance());
    let (mut pose, mut global) = walker.buffers();
    let terrain = HeightField::hills(3, 40.0, 4.0).unwrap();
    let feet = [None, Some(StepSettings::default())].map(|steps| {
        let settings = FootSettings { steps, ..FootSettings::default() };
        FootPlacement::new(skeleton, &walker.roles, &stance, 0.0, settings).unwrap()
    });
    let limb = Limb::new(skeleton, ANKLES[0], &stance, LimbSettings::LEG).unwrap();
    let limits = [JointLimit { cone: 0.4, twist: 0.1 }; 2];
    let chain =
        Chain::new(skeleton, [9, 11], &skeleton.rest_pose(), &limits, ChainSettings::default());
    let chain = chain.unwrap();
    let hips = Hips::new(skeleton, &walker.roles, HipsSettings::default()).unwrap();
    let look = |joint| LookJoint { joint, share: 1.0, limit: [0.8, 0.5] };
    let look =
        LookAt::new(skeleton, &[look(10), look(11)], &stance, LookSettings::default()).unwrap();
    let (mut scratch, mut looks) = (chain.scratch(), look.state());
    let (mut feet_state, mut hips_state) = (FeetState::default(), HipsState::default());

    let before = ALLOCATIONS.get();
    for frame in 0..300 {
        let (time, dt) = (frame as f32 / 60.0, 1.0 / 60.0);
        let target = walker.root(time) + Vec3::new(time.sin(), 1.2, time.cos());
        let contacts = walker.pose(time, 0.0, &mut pose, &mut global);
        let want = Want { root: target, target, comfort: 0.1, reach: 0.2, weight: 1.0 };
        let wants = [Want { target: target + Vec3::Y * 0.3, ..want }, want];
        let ground = Ground { terrain: &terrain, level: Some(0.0) };
        let asked = Reach { pole: Some(Pole::Point(target)), weight: 0.5, ..Reach::at(target) };
        let done = [
            hips.step(skeleton, &mut hips_state, &wants, dt, &mut pose, &mut global),
            feet[frame / 50 % 2].step(
                skeleton,
                &mut feet_state,
                contacts,
                &ground,
                dt,
                &mut pose,
                &mut global,
            ),
            chain.solve(skeleton, &mut scratch, target, 0.5, &mut pose, &mut global),
            look.step(skeleton, &mut looks, Some(target), 1.0, dt, &mut pose, &mut global),
            limb.reach(skeleton, &asked, &mut pose, &mut global),
        ];
        assert_eq!(done, [true; 5]);
    }
    assert_eq!(ALLOCATIONS.get(), before);
}
