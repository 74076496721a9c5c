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

fn intensity(light: usize, watts_per_sr: f64) -> Edit {
    let intensity = RadiantIntensity(watts_per_sr);
    Edit::LightIntensity { light, intensity }
}

fn sun(light: usize, watts_per_m2: f64) -> Edit {
    let normal_irradiance = Irradiance(watts_per_m2);
    Edit::LightNormalIrradiance {
        light,
        normal_irradiance,
    }
}

fn brightness(light: usize, brightness: f64) -> Edit {
    Edit::LightBrightness { light, brightness }
}

fn sphere(light: usize, radius_m: f64) -> Edit {
    let size = LightSize::Radius { radius_m };
    Edit::LightSize { light, size }
}

fn disc(light: usize, diameter_rad: f64) -> Edit {
    let size = LightSize::Angle { diameter_rad };
    Edit::LightSize { light, size }
}

fn position(light: usize, position: DVec3) -> Edit {
    Edit::LightPosition { light, position }
}

fn direction(light: usize, direction: DVec3) -> Edit {
    Edit::LightDirection { light, direction }
}

fn colour(r: f64) -> Edit {
    let colour = LinearSrgb::new(r, 0.5 * r, 0.0);
    Edit::LightColour { light: 0, colour }
}

fn ior(material: usize, ior: f64) -> Edit {
    Edit::MaterialIor { material, ior }
}

fn tint(material: usize, r: f64) -> Edit {
    let base_colour = LinearSrgb::new(r, 0.2, 0.3);
    Edit::MaterialTint {
        material,
        base_colour,
    }
}

fn roughness(material: usize, roughness: f64) -> Edit {
    Edit::MaterialRoughness { material, roughness }
}

fn moved(object: usize, rotation: DQuat, translation: DVec3) -> Edit {
    Edit::ObjectMoved {
        object,
        rotation,
        translation,
    }
}

fn edits() -> Vec<Edit> {
    let waves = Edit::MaterialWaves {
        material: 1,
        waves: Some(ripples()),
    };
    let lifted = moved(1, DQuat::IDENTITY, DVec3::Y);
    vec![
        intensity(0, 0.3),
        intensity(2, 1e9),
        sun(1, 0.7),
        position(0, DVec3::new(0.1, 2.7, -0.3)),
        position(2, DVec3::ZERO),
        direction(1, DVec3::new(0.0, -7.0, 1.0)),
        direction(2, DVec3::NEG_Y),
        colour(1.0),
        sphere(0, 0.1),
        disc(1, std::f64::consts::PI),
        sphere(2, 1.0 / 3.0),
        brightness(3, 0.7),
        position(3, DVec3::Y),
        brightness(4, 1e9),
        brightness(5, 0.1),
        ior(1, 1.7),
        tint(0, 0.1),
        roughness(1, 0.9),
        roughness(0, 0.1),
        waves,
        moved(1, DQuat::IDENTITY, DVec3::new(0.1, 0.0, 1.0 / 3.0)),
        moved(1, DQuat::from_rotation_x(0.3), DVec3::X),
        Edit::Several(vec![ior(1, 1.3), ior(1, 2.3), lifted]),
    ]
}

/// Everything that edits can reach, as text: numbers are written so that different bits differ.
fn image(scene: &Scene) -> String {
    format!("{:?} {:?} {:?}", scene.lights, scene.materials, scene.objects)
}

#[test]
fn edits_undo_bit_for_bit() {
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
fn edits_share_what_they_leave() {
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
fn roughness_changes_the_class() {
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
fn objects_turn_about_their_middle() {
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
fn edits_of_a_control_share_a_target() {
    assert_eq!(intensity(0, 1.0).target(), intensity(0, 2.0).target());
    assert_eq!(intensity(0, 1.0).target(), EditTarget::LightPower(0));
    let mut targets: Vec<_> = edits().iter().map(Edit::target).collect();
    targets.dedup();
    assert_eq!(
        targets.len(),
        edits().len() - 1,
        "only the two movements share one"
    );
}

#[test]
fn edits_out_of_range_are_refused() {
    let scene = scene();
    let nan = f64::NAN;
    let turned = |x, w| moved(0, DQuat::from_xyzw(x, 0.0, 0.0, w), DVec3::ZERO);
    let shifted = |object, x| moved(object, DQuat::IDENTITY, DVec3::X * x);
    let mut mesh = (*scene.objects[0].mesh).clone();
    mesh.triangles[0][0] = 4;
    let broken = Edit::ObjectMesh {
        object: 0,
        mesh: Arc::new(mesh),
    };
    let sizeless = Edit::LightSize {
        light: 3,
        size: LightSize::None,
    };
    let refused = [
        (intensity(6, 1.0), "light 6"),
        (intensity(3, 1.0), "light `large`"),
        (brightness(0, 1.0), "set its intensity"),
        (brightness(3, 0.0), "light `large`"),
        (brightness(5, nan), "light `large`"),
        (sphere(0, 0.0), "a radius above 0 m"),
        (sphere(0, nan), "a radius above 0 m"),
        (disc(0, 0.1), "a radius above 0 m"),
        (disc(1, 3.2), "up to π for suns"),
        (sphere(1, 0.1), "up to π for suns"),
        (sizeless, "light `large`"),
        (intensity(0, nan), "light `light`"),
        (intensity(0, -1.0), "light `light`"),
        (intensity(0, 0.0), "light `light`"),
        (intensity(0, f64::INFINITY), "light `light`"),
        (intensity(1, 1.0), "set its normal irradiance"),
        (sun(0, 1.0), "set its radiant intensity"),
        (sun(1, -1.0), "W/m²"),
        (position(1, DVec3::ONE), "set its direction"),
        (position(0, DVec3::splat(nan)), "light `light`"),
        (position(0, DVec3::X * 1e13), "m"),
        (direction(0, DVec3::X), "set its position"),
        (direction(1, DVec3::ZERO), "direction"),
        (direction(1, DVec3::NAN), "direction"),
        (colour(-1.0), "colour"),
        (colour(0.0), "colour"),
        (colour(nan), "colour"),
        (ior(1, 0.99), "refractive index of 0.99"),
        (ior(1, nan), "material `glass`"),
        (tint(1, 1.01), "base colour"),
        (tint(1, nan), "base colour"),
        (roughness(1, -0.1), "roughness of -0.1"),
        (roughness(1, nan), "roughness"),
        (shifted(2, 1.0), "the scene has 2 of them"),
        (shifted(0, nan), "object `floor`"),
        (shifted(0, 1e12), "object `floor`"),
        (turned(0.0, 0.0), "rotation"),
        (turned(nan, 1.0), "rotation"),
        (broken, "object `floor`"),
        (
            Edit::Several(vec![ior(1, 1.2), ior(1, 0.0)]),
            "refractive index of 0",
        ),
        (ior(9, 1.5), "material 9"),
    ];
    for (edit, part) in refused {
        let error = edit.apply(&scene).expect_err("it is out of range");
        assert_eq!(error.kind, ErrorKind::Usage);
        let sentence = error.to_string();
        assert!(sentence.contains(part) && !sentence.contains('\n'), "{sentence}");
    }
}
