//! Edits and their inverses.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use nephroid::error::ErrorKind;
use nephroid::optics::LinearSrgb;
use nephroid::scene::builtin::{parts, shapes};
use nephroid::scene::texture::Wrap;
use nephroid::scene::{
    Edit, EditTarget, Light, LightKind, LightSize, PanelShape, Scene, SurfaceKind, Texture, Wave, Waves,
};
use nephroid::units::{Flux, Irradiance, Radiance, RadiantIntensity};

/// A scene with a floor (object 0), a glass ball (object 1), an image, a lamp (light 0), a sun (1), a spot (2), a panel (3),
/// the floor as a lamp (4) and an environment (5).
fn scene() -> Scene {
    let mut scene = parts::reference_scene(0.6);
    let ball = shapes::sphere(DVec3::new(0.0, 0.8, 0.0), 0.5, 2);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    scene
        .lights
        .push(parts::point_light("light", DVec3::Y * 3.0, Flux(100.0)));
    scene
        .lights
        .push(parts::sun("sun", DVec3::new(1.0, -3.0, 0.2), Irradiance(2.0)));
    let mut spot = scene.lights[0].clone();
    spot.name = "spot".into();
    spot.kind = LightKind::Spot {
        position: DVec3::new(0.1, 2.0, 0.3),
        direction: DVec3::new(0.3, -0.9, 0.1).normalize(),
        intensity: RadiantIntensity(3.0),
        inner_cone_rad: 0.1,
        outer_cone_rad: 0.4,
    };
    scene.lights.push(spot);
    let kinds = [
        LightKind::Panel {
            centre: DVec3::Y * 2.0,
            across: DVec3::X,
            down: DVec3::Z,
            shape: PanelShape::Disc,
            radiance: Radiance(3.0),
        },
        LightKind::Surface {
            object: 0,
            radiance: Radiance(1.0),
        },
        LightKind::Environment { scale: 1.0 },
    ];
    for kind in kinds {
        scene.lights.push(Light {
            name: "large".into(),
            colour: LinearSrgb::WHITE,
            spectrum: None,
            kind,
            size: LightSize::None,
        });
    }
    scene.textures.push(Arc::new(Texture {
        name: "white".into(),
        width: 1,
        height: 1,
        rgba: vec![[255; 4]],
        wrap: [Wrap::Repeat; 2],
    }));
    scene
}

fn ripples() -> Waves {
    let wave = Wave {
        amplitude_m: 0.001,
        wavelength_m: 0.1,
        direction: DVec3::X,
        phase_rad: 0.3,
    };
    Waves::new(vec![wave]).expect("a gentle wave")
}

fn edits() -> Vec<Edit> {
    vec![
        Edit::LightIntensity {
            light: 0,
            intensity: RadiantIntensity(0.3),
        },
        Edit::LightIntensity {
            light: 2,
            intensity: RadiantIntensity(1e9),
        },
        Edit::LightNormalIrradiance {
            light: 1,
            normal_irradiance: Irradiance(0.7),
        },
        Edit::LightPosition {
            light: 0,
            position: DVec3::new(0.1, 2.7, -0.3),
        },
        Edit::LightPosition {
            light: 2,
            position: DVec3::ZERO,
        },
        Edit::LightDirection {
            light: 1,
            direction: DVec3::new(0.0, -7.0, 1.0),
        },
        Edit::LightDirection {
            light: 2,
            direction: DVec3::NEG_Y,
        },
        Edit::LightColour {
            light: 0,
            colour: LinearSrgb::new(1.0, 0.5, 0.0),
        },
        Edit::LightSize {
            light: 0,
            size: LightSize::Radius { radius_m: 0.1 },
        },
        Edit::LightSize {
            light: 1,
            size: LightSize::Angle {
                diameter_rad: std::f64::consts::PI,
            },
        },
        Edit::LightSize {
            light: 2,
            size: LightSize::Radius { radius_m: 1.0 / 3.0 },
        },
        Edit::LightBrightness {
            light: 3,
            brightness: 0.7,
        },
        Edit::LightPosition {
            light: 3,
            position: DVec3::Y,
        },
        Edit::LightBrightness {
            light: 4,
            brightness: 1e9,
        },
        Edit::LightBrightness {
            light: 5,
            brightness: 0.1,
        },
        Edit::MaterialIor {
            material: 1,
            ior: 1.7,
        },
        Edit::MaterialTint {
            material: 0,
            base_colour: LinearSrgb::new(0.1, 0.2, 0.3),
        },
        Edit::MaterialRoughness {
            material: 1,
            roughness: 0.9,
        },
        Edit::MaterialRoughness {
            material: 0,
            roughness: 0.1,
        },
        Edit::MaterialWaves {
            material: 1,
            waves: Some(ripples()),
        },
        Edit::ObjectMoved {
            object: 1,
            rotation: DQuat::IDENTITY,
            translation: DVec3::new(0.1, 0.0, 1.0 / 3.0),
        },
        Edit::ObjectMoved {
            object: 1,
            rotation: DQuat::from_rotation_x(0.3),
            translation: DVec3::X,
        },
        Edit::Several(vec![
            Edit::MaterialIor {
                material: 1,
                ior: 1.3,
            },
            Edit::MaterialIor {
                material: 1,
                ior: 2.3,
            },
            Edit::ObjectMoved {
                object: 1,
                rotation: DQuat::IDENTITY,
                translation: DVec3::Y,
            },
        ]),
    ]
}

/// Everything that edits can reach, as text: numbers are written so that different bits differ.
fn image(scene: &Scene) -> String {
    format!("{:?} {:?} {:?}", scene.lights, scene.materials, scene.objects)
}

#[test]
fn every_edit_is_undone_bit_for_bit_and_can_be_done_again() {
    let scene = scene();
    for edit in edits() {
        let (edited, inverse) = edit.apply(&scene).expect("it is in range");
        assert_ne!(image(&edited), image(&scene), "{edit:?} changes something");
        let (restored, again) = inverse.apply(&edited).expect("what was, is in range");
        assert!(image(&restored) == image(&scene), "{inverse:?}");
        let (repeated, _) = again.apply(&restored).expect("it is in range");
        assert!(image(&repeated) == image(&edited), "{again:?}");
    }
}

#[test]
fn what_is_not_touched_is_shared_and_the_scene_itself_stays() {
    let scene = scene();
    let before = image(&scene);
    for edit in edits() {
        let moves = matches!(&edit, Edit::ObjectMoved { .. } | Edit::Several(_));
        let (edited, inverse) = edit.apply(&scene).expect("it is in range");
        assert!(image(&scene) == before);
        assert!(Arc::ptr_eq(&edited.textures[0], &scene.textures[0]));
        assert!(Arc::ptr_eq(&edited.objects[0].mesh, &scene.objects[0].mesh));
        assert_eq!(
            Arc::ptr_eq(&edited.objects[1].mesh, &scene.objects[1].mesh),
            !moves,
            "{edit:?}"
        );
        let (restored, _) = inverse.apply(&edited).expect("what was, is in range");
        assert!(
            Arc::ptr_eq(&restored.objects[1].mesh, &scene.objects[1].mesh),
            "a movement that is taken back gives the old mesh itself"
        );
    }
}

#[test]
fn roughness_changes_the_class_as_loading_does() {
    let scene = scene();
    let class = |scene: &Scene, material: usize, roughness: f64| {
        let edit = Edit::MaterialRoughness { material, roughness };
        let (edited, _) = edit.apply(scene).expect("it is in range");
        edited.materials[material].surface
    };
    assert_eq!(class(&scene, 1, 0.3), SurfaceKind::Dielectric);
    assert_eq!(class(&scene, 1, 0.6), SurfaceKind::Dielectric);
    assert_eq!(class(&scene, 1, 0.61), SurfaceKind::Diffuse);
    assert_eq!(class(&scene, 0, 0.3), SurfaceKind::Mixed);
    let mut others = scene.clone();
    others.materials[0] = parts::mirror();
    assert_eq!(class(&others, 0, 0.2), SurfaceKind::Mirror);
    assert_eq!(class(&others, 0, 0.5), SurfaceKind::Mirror);
    assert_eq!(class(&others, 0, 0.7), SurfaceKind::Diffuse);
    others.materials[0] = parts::dielectric("pane", 1.5);
    others.materials[0].volume = None;
    others.materials[0].surface = SurfaceKind::ThinWall;
    assert_eq!(class(&others, 0, 0.2), SurfaceKind::ThinWall);
    // Unlit: smooth by its factors, matte because the file says so.
    others.materials[0] = parts::mirror();
    others.materials[0].surface = SurfaceKind::Diffuse;
    assert_eq!(class(&others, 0, 0.1), SurfaceKind::Diffuse);
}

#[test]
fn a_turned_object_turns_about_its_middle_and_keeps_its_normals_unit() {
    let scene = scene();
    let edit = Edit::ObjectMoved {
        object: 0,
        // Of any length: made unit.
        rotation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2) * 3.0,
        translation: DVec3::new(0.0, 0.25, 0.0),
    };
    let (edited, _) = edit.apply(&scene).expect("it is in range");
    let (low, high) = edited.objects[0].mesh.bounds().expect("a floor");
    let expected = (DVec3::new(0.0, -0.35, -0.6), DVec3::new(0.0, 0.85, 0.6));
    assert!(
        low.distance(expected.0) < 1e-12 && high.distance(expected.1) < 1e-12,
        "{low} {high}"
    );
    for normal in &edited.objects[0].mesh.normals {
        assert!(normal.distance(DVec3::NEG_X) < 1e-12, "{normal}");
    }
}

#[test]
fn edits_of_the_same_control_share_a_target() {
    let power = |watts| Edit::LightIntensity {
        light: 0,
        intensity: RadiantIntensity(watts),
    };
    assert_eq!(power(1.0).target(), power(2.0).target());
    assert_eq!(power(1.0).target(), EditTarget::LightPower(0));
    let mut targets: Vec<_> = edits().iter().map(Edit::target).collect();
    targets.dedup();
    assert_eq!(
        targets.len(),
        edits().len() - 1,
        "only the two movements share one"
    );
}

#[test]
fn values_out_of_range_are_refused_in_one_sentence() {
    let scene = scene();
    let nan = f64::NAN;
    let light = |light, watts| Edit::LightIntensity {
        light,
        intensity: RadiantIntensity(watts),
    };
    let sun = |light, value| Edit::LightNormalIrradiance {
        light,
        normal_irradiance: Irradiance(value),
    };
    let bright = |light, brightness| Edit::LightBrightness { light, brightness };
    let sized = |light, size| Edit::LightSize { light, size };
    let place = |light, position| Edit::LightPosition { light, position };
    let towards = |light, direction| Edit::LightDirection { light, direction };
    let colour = |r| Edit::LightColour {
        light: 0,
        colour: LinearSrgb::new(r, 0.0, 0.0),
    };
    let ior = |ior| Edit::MaterialIor { material: 1, ior };
    let tint = |r| Edit::MaterialTint {
        material: 1,
        base_colour: LinearSrgb::new(r, 0.0, 0.0),
    };
    let roughness = |roughness| Edit::MaterialRoughness {
        material: 1,
        roughness,
    };
    let moved = |object, x| Edit::ObjectMoved {
        object,
        rotation: DQuat::IDENTITY,
        translation: DVec3::X * x,
    };
    let turned = |rotation| Edit::ObjectMoved {
        object: 0,
        rotation,
        translation: DVec3::ZERO,
    };
    let mut broken = (*scene.objects[0].mesh).clone();
    broken.triangles[0][0] = 4;
    let refused = [
        (light(6, 1.0), "light 6"),
        (light(3, 1.0), "light `large`"),
        (bright(0, 1.0), "set its intensity"),
        (bright(3, 0.0), "light `large`"),
        (bright(5, nan), "light `large`"),
        (
            sized(0, LightSize::Radius { radius_m: 0.0 }),
            "a radius above 0 m",
        ),
        (
            sized(0, LightSize::Radius { radius_m: nan }),
            "a radius above 0 m",
        ),
        (
            sized(0, LightSize::Angle { diameter_rad: 0.1 }),
            "a radius above 0 m",
        ),
        (
            sized(1, LightSize::Angle { diameter_rad: 3.2 }),
            "up to π for suns",
        ),
        (sized(1, LightSize::Radius { radius_m: 0.1 }), "up to π for suns"),
        (sized(3, LightSize::None), "light `large`"),
        (light(0, nan), "light `light`"),
        (light(0, -1.0), "light `light`"),
        (light(0, 0.0), "light `light`"),
        (light(0, f64::INFINITY), "light `light`"),
        (light(1, 1.0), "set its normal irradiance"),
        (sun(0, 1.0), "set its radiant intensity"),
        (sun(1, -1.0), "W/m²"),
        (place(1, DVec3::ONE), "set its direction"),
        (place(0, DVec3::splat(nan)), "light `light`"),
        (place(0, DVec3::X * 1e13), "m"),
        (towards(0, DVec3::X), "set its position"),
        (towards(1, DVec3::ZERO), "direction"),
        (towards(1, DVec3::NAN), "direction"),
        (colour(-1.0), "colour"),
        (colour(0.0), "colour"),
        (colour(nan), "colour"),
        (ior(0.99), "refractive index of 0.99"),
        (ior(nan), "material `glass`"),
        (tint(1.01), "base colour"),
        (tint(nan), "base colour"),
        (roughness(-0.1), "roughness of -0.1"),
        (roughness(nan), "roughness"),
        (moved(2, 1.0), "the scene has 2 of them"),
        (moved(0, nan), "object `floor`"),
        (moved(0, 1e12), "object `floor`"),
        (turned(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)), "rotation"),
        (turned(DQuat::from_xyzw(nan, 0.0, 0.0, 1.0)), "rotation"),
        (
            Edit::ObjectMesh {
                object: 0,
                mesh: Arc::new(broken),
            },
            "object `floor`",
        ),
        (Edit::Several(vec![ior(1.2), ior(0.0)]), "refractive index of 0"),
        (
            Edit::MaterialIor {
                material: 9,
                ior: 1.5,
            },
            "material 9",
        ),
    ];
    for (edit, part) in refused {
        let error = edit.apply(&scene).expect_err("it is out of range");
        assert_eq!(error.kind, ErrorKind::Usage);
        let sentence = error.to_string();
        assert!(sentence.contains(part) && !sentence.contains('\n'), "{sentence}");
    }
}
