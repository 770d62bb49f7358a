//! What a frame takes from the allocator: nothing while the camera stands still, and when it moves a number that does not
//! depend on how many patches there are.
#![allow(missing_docs, reason = "a test")]
#![allow(unsafe_code, reason = "counting allocations takes an allocator of one's own, whose trait is unsafe")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use seamount::prelude::*;
use seamount::terrain::generate;

thread_local! {
    /// Calls and bytes of this thread.
    static TAKEN: Cell<[usize; 2]> = const { Cell::new([0; 2]) };
}

struct Counting;

// SAFETY: every call goes to the system's allocator unchanged. Counting touches a thread local that needs no memory and no
// destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        TAKEN.set([TAKEN.get()[0] + 1, TAKEN.get()[1] + layout.size()]);
        // SAFETY: the caller's promises are those that the system asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above; the pointer came from `alloc`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        TAKEN.set([TAKEN.get()[0] + 1, TAKEN.get()[1] + size]);
        // SAFETY: as above; the pointer came from `alloc`.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Most allocations and bytes that a frame of the scene below may take while the camera moves: the paths, states and view
/// volumes of its three walks.
const CALLS: usize = 60;
const BYTES: usize = 8 << 10;

#[test]
fn a_warm_frame_allocates_nothing_or_a_small_constant() {
    warm_frames(VoidMode::Fill);
}

#[test]
fn so_does_a_warm_frame_of_a_map_with_holes() {
    warm_frames(VoidMode::Hole);
}

fn warm_frames(voids: VoidMode) {
    let field = generate(1025, 3).unwrap();
    let pixels = (0..1025).flat_map(|r| (0..1025).map(move |c| (c, r))).map(|(c, r)| {
        // Some blocks, and voids by themselves, all over the map.
        if c % 200 < 20 && r % 150 < 30 || (c * 7 + r * 13) % 997 == 0 { 0 } else { field.raw(c, r).max(1.0) as u16 }
    });
    let pixels = pixels.collect();
    let mut scene = Scene::new();
    let root = scene.root();
    let camera = scene.add(root, PerspectiveCamera::default()).unwrap();
    scene.add(root, DirectionalLight::default()).unwrap();
    scene.add(root, Texture2::from_image(Image::new(1025, 1025, Pixels::Gray16(pixels)).unwrap())).unwrap();
    let land = SeamlessTerrain {
        scale: 100.0,
        max_height: 10.0,
        resolutions: (4, 2),
        void_sample: Some(0.0),
        voids,
        ..SeamlessTerrain::default()
    };
    let terrain = scene.add(root, land).unwrap();
    let mut view = View::default();
    let action = RenderAction::new(1280, 720);

    let mut of_tolerance = Vec::new();
    for (tolerance, morph) in [(16.0, false), (1.0, false), (16.0, true), (1.0, true)] {
        {
            let mut land = scene.edit::<SeamlessTerrain>(terrain).unwrap();
            (land.detail, land.morph) = (DetailMode::PixelError(tolerance), morph);
        }
        let (mut most, mut patches) = ([0; 2], u64::MAX);
        // The first time round warms up: buffers grow to what the circle needs.
        for k in 0..120 {
            let angle = f64::from(k) / 60.0 * std::f64::consts::TAU;
            {
                let mut camera = scene.edit::<PerspectiveCamera>(camera).unwrap();
                camera.position = Some(DVec3::new(50.0 + 60.0 * angle.cos(), 50.0 + 60.0 * angle.sin(), 25.0));
                camera.look_at = Some(DVec3::new(50.0, 50.0, 0.0));
            }
            let taken = |action: &RenderAction, view: &mut View| {
                let before = TAKEN.get();
                let patches = action.apply_in(&scene, view).unwrap().statistics.patches_rendered;
                let after = TAKEN.get();
                ([after[0] - before[0], after[1] - before[1]], patches)
            };
            let (moving, drawn) = taken(&action, &mut view);
            let (still, _) = taken(&action, &mut view);
            assert_eq!(still, [0, 0], "a still camera allocates");
            if k >= 60 {
                most = [most[0].max(moving[0]), most[1].max(moving[1])];
                patches = patches.min(drawn);
            }
        }
        println!(
            "τ = {tolerance}, morph {morph}: at most {} allocations of {} bytes; at least {patches} patches",
            most[0], most[1]
        );
        assert!(most[0] <= CALLS && most[1] <= BYTES, "{most:?}");
        of_tolerance.push((most, patches));
    }
    // The counts are of frames that differ in what they show, and the same.
    let [(few, small), (many, large), (few_morphed, _), (many_morphed, _)] = of_tolerance[..] else { panic!("four") };
    assert!(large > 8 * small, "{small} and {large} patches");
    assert_eq!([few, many, few_morphed], [many_morphed; 3]);
}

/// A pick far from a text does not lay it out, which would take memory for its characters.
#[test]
fn a_pick_far_from_text_allocates_nothing_for_it() {
    let taken = |string: &str, x: f64| {
        let mut scene = Scene::new();
        let root = scene.root();
        let (position, look_at) = (Some(DVec3::Z * 9.0), Some(DVec3::ZERO));
        scene.add(root, PerspectiveCamera { position, look_at, ..PerspectiveCamera::default() }).unwrap();
        let justification = Justification::Right;
        scene.add(root, Text2 { string: string.into(), justification, ..Text2::default() }).unwrap();
        let picker = RayPickAction::pixel(0, 0, [1280, 720]).picker(&scene).unwrap();
        let pick = || picker.pick_through(x, 0.497, true).unwrap().len();
        pick();
        let before = TAKEN.get();
        let met = pick();
        (met, TAKEN.get()[0] - before[0])
    };
    // It goes to the left of the middle, however long it is.
    let long = "label".repeat(100);
    let (short, far, near) = (taken("label", 0.9), taken(&long, 0.9), taken(&long, 0.49));
    assert_eq!((short.0, far.0, near.0), (0, 0, 1));
    assert_eq!(far.1, short.1);
    assert!(near.1 > far.1 + 4, "{near:?}, {far:?}");
}
