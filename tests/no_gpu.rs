//! Who asks where something is needs no graphics card: no object is made there, and no colour image is decoded.
#![cfg(feature = "render")]

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use seamount::action::walk::Go;
use seamount::action::{ButtonState, Event, EventKind, EventType, MouseButton};
use seamount::node::Registry;
use seamount::prelude::*;
use seamount::render::{Headless, ObjectsMade, check_shaders};

/// A scene of all kinds of shapes, with an image of colours that looks whole until it is decoded.
fn scene(folder: &std::path::Path) -> Scene {
    let broken = folder.join("broken.png");
    let mut bytes = Vec::new();
    let whole = image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([(x * y) as u8, x as u8, y as u8]));
    whole.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    // The header stays as it is.
    let middle = bytes.len() / 2;
    bytes[middle..middle + 40].fill(0xff);
    std::fs::write(&broken, bytes).unwrap();
    let (width, height) = image::image_dimensions(&broken).unwrap();
    assert_eq!((width, height), (64, 64), "who asks for its size alone finds nothing wrong");
    assert!(Image::open(&broken).is_err(), "its pixels are broken");

    let text = format!(
        "Scene(version: 1, root: Separator(children: [
            PerspectiveCamera(position: (0.5, -1.5, 1.5), look_at: (0.5, 0.5, 0.0)),
            DirectionalLight(direction: (0.5, 0.3, -1.0), shadow: true),
            Environment(fog_type: Fog), Background(zenith: (0.1, 0.2, 0.7)),
            TextureUnit(unit: 1), Texture2(filename: {broken:?}),
            TextureUnit(unit: 0),
            Separator(children: [
                Translation(translation: (0.5, 0.5, 0.5)), Scale(scale_factor: (0.1, 0.1, 0.1)),
                Sphere(), Cube(), Cone(), Cylinder(),
            ]),
            Separator(children: [
                Coordinate3(point: [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]),
                IndexedFaceSet(coord_index: [0, 1, 2, 3, -1]), IndexedLineSet(coord_index: [0, 2, -1]), PointSet(),
            ]),
            Def(\"ground\", Separator(children: [ColorRamp(), ContourLines(), NormalMap(unit: 1), BumpMap(unit: 1)])),
        ]))",
    );
    let mut scene = seamount::format::parse(&text, &Registry::default()).unwrap_or_else(|error| panic!("{error}"));
    let ground = scene.find("ground").unwrap();
    let heights = (0..33 * 33u32).map(|i| (i * 7919 % 65_521) as u16).collect();
    let map = Image::new(33, 33, Pixels::Gray16(heights)).unwrap();
    scene.add(ground, Texture2::from_image(map)).unwrap();
    scene.add(ground, SeamlessTerrain::default()).unwrap();
    scene
}

/// One test, so that nothing else of this program makes objects meanwhile.
#[test]
fn questions_make_no_gpu_object_and_a_frame_does() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path());
    let size = [64, 48];

    let bounds = BoundingBoxAction::default().apply(&scene).unwrap().unwrap();
    assert!(bounds.contains(DVec3::splat(0.5)));
    assert!(BoundingBoxAction::default().oriented(&scene).unwrap().is_some());
    let found = SearchAction { kind: Some("SeamlessTerrain".into()), ..Default::default() }.apply(&scene).unwrap();
    let [path] = found.as_slice() else { panic!("{found:?}") };
    assert!(MatrixAction::new(path.clone()).apply(&scene).unwrap().is_some());
    let count = PrimitiveCountAction::default().apply(&scene).unwrap();
    assert!(count.triangles > 100 && count.lines > 0 && count.points > 0, "{count:?}");
    let (mut nodes, mut triangles) = (0, 0);
    let mut callbacks = CallbackAction::new()
        .before(None, |_| {
            nodes += 1;
            Go::On
        })
        .triangles(None, |_, _| triangles += 1);
    callbacks.apply(&scene).unwrap();
    drop(callbacks);
    assert!(nodes > 20 && triangles > 100, "{nodes} nodes, {triangles} triangles");

    let down = Ray::new(DVec3::new(0.5, 0.51, 9.0), DVec3::NEG_Z).unwrap();
    for surface in [Surface::Coarse, Surface::Drawn, Surface::Exact] {
        for all in [false, true] {
            let hits = RayPickAction { surface, all, ..RayPickAction::ray(down) }.apply(&scene).unwrap();
            assert!(hits.len() >= if all { 3 } else { 1 }, "{surface:?}: {hits:?}");
            for through in [RayPickAction::pixel(32, 24, size), RayPickAction::normalized(0.5, 0.5, size)] {
                assert!(!RayPickAction { surface, all, ..through }.apply(&scene).unwrap().is_empty());
            }
        }
        let picker = RayPickAction { surface, ..RayPickAction::ray(down) }.picker(&scene).unwrap();
        assert!(picker.pick_many(&[down; 100], false).unwrap().iter().all(|hits| !hits.is_empty()));
    }
    assert!(scene.height_at(0.5, 0.5).unwrap().is_some());
    assert!(scene.line_of_sight(DVec3::new(0.5, 0.51, 9.0), DVec3::new(0.5, 0.51, -9.0)).unwrap().is_some());

    let clicks = Arc::new(AtomicU32::new(0));
    let counted = Arc::clone(&clicks);
    let clicked = EventCallback::new(EventType::MouseButton, move |cx| {
        counted.fetch_add(u32::from(cx.picked()?.is_some()), Ordering::Relaxed);
        Ok(())
    });
    let root = scene.root();
    scene.add(root, clicked).unwrap();
    let press = EventKind::MouseButton { button: MouseButton::Left, state: ButtonState::Pressed };
    HandleEventAction::new(size).apply(&mut scene, &Event::new(press, DVec2::new(32.5, 24.5))).unwrap();
    assert_eq!(clicks.load(Ordering::Relaxed), 1, "something is picked in the middle");
    assert_eq!(scene.resources().decoded(), 0, "nobody asked for colours");

    // Who draws has to look at the colours. With such that can be had the frame is plain data, still without a GPU.
    let action = RenderAction::new(size[0], size[1]);
    let error = action.apply(&scene).unwrap_err().to_string();
    assert!(error.contains("broken.png"), "{error}");
    image::RgbImage::new(2, 2).save(folder.path().join("broken.png")).unwrap();
    scene.resources().forget();
    let explained = action.explain(&scene).unwrap();
    assert!(explained.draws.len() > 5 && explained.frame.sky.is_some());
    assert!(scene.resources().decoded() > 0);
    check_shaders(&explained.frame).unwrap();
    assert_eq!(ObjectsMade::so_far(), ObjectsMade::default());

    Headless::new(None).unwrap().draw(&explained.frame).unwrap();
    let ObjectsMade { devices, buffers, textures, shader_modules, pipelines, others } = ObjectsMade::so_far();
    for (made, kind) in [
        (devices, "devices"),
        (buffers, "buffers"),
        (textures, "textures"),
        (shader_modules, "shader modules"),
        (pipelines, "pipelines"),
        (others, "others"),
    ] {
        assert!(made > 0, "a frame makes {kind}");
    }
}
