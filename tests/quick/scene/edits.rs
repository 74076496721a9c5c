//! Edits and their inverses.

use nephroid::error::ErrorKind;
use nephroid::scene::PanelShape;

use crate::prelude::*;
use support::floors::four_colours;
use support::scenes::{panel, spot, wave};

/// A scene with a floor (object 0), a glass ball (object 1), an image, a lamp (light 0), a sun (1), a spot (2), a panel (3),
/// the floor as a lamp (4) and an environment (5).
fn scene() -> Scene {
    let mut scene = parts::reference_scene(0.6);
    let ball = shapes::sphere(dvec3(0.0, 0.8, 0.0), 0.5, 2);
    parts::add(&mut scene, "ball", ball, parts::dielectric("glass", 1.5));
    let lamp = parts::point_light("light", DVec3::Y * 3.0, Flux(100.0));
    let sun = parts::sun("sun", dvec3(1.0, -3.0, 0.2), Irradiance(2.0));
    let other = |name: &str, kind| Light {
        name: name.into(),
        kind,
        ..support::scenes::point_light(DVec3::ZERO, 1.0)
    };
    let spot = spot(dvec3(0.1, 2.0, 0.3), dvec3(0.3, -0.9, 0.1), 3.0, [0.1, 0.4]);
    let panel = panel(DVec3::Y * 2.0, [DVec3::X, DVec3::Z], PanelShape::Disc, 3.0);
    let radiance = Radiance(1.0);
    let glow = other("large", LightKind::Surface { object: 0, radiance });
    let sky = other("large", LightKind::Environment { scale: 1.0 });
    let (spot, panel) = (other("spot", spot.kind), other("large", panel.kind));
    scene.lights.extend([lamp, sun, spot, panel, glow, sky]);
    scene.textures.push(Arc::new(four_colours()));
    scene
}

fn ripples() -> Waves {
    Waves::new(vec![wave(0.001, 0.1, DVec3::X, 0.3)]).expect("a gentle wave")
}

fn strength(light: usize, strength: f64) -> Edit {
    Edit::Light(light, LightEdit::Strength(strength))
}

fn sphere(light: usize, radius_m: f64) -> Edit {
    let size = LightSize::Radius { radius_m };
    Edit::Light(light, LightEdit::Size(size))
}

fn disc(light: usize, diameter_rad: f64) -> Edit {
    let size = LightSize::Angle { diameter_rad };
    Edit::Light(light, LightEdit::Size(size))
}

fn position(light: usize, position: DVec3) -> Edit {
    Edit::Light(light, LightEdit::Position(position))
}

fn direction(light: usize, direction: DVec3) -> Edit {
    Edit::Light(light, LightEdit::Direction(direction))
}

fn colour(r: f64) -> Edit {
    Edit::Light(0, LightEdit::Colour(rgb(r, 0.5 * r, 0.0), None))
}

fn ior(material: usize, ior: f64) -> Edit {
    Edit::Material(material, MaterialEdit::Ior(ior))
}

fn tint(material: usize, r: f64) -> Edit {
    Edit::Material(material, MaterialEdit::BaseColour(rgb(r, 0.2, 0.3)))
}

fn roughness(material: usize, roughness: f64) -> Edit {
    Edit::Material(material, MaterialEdit::Roughness(roughness))
}

fn moved(object: usize, rotation: DQuat, translation: DVec3) -> Edit {
    let motion = Motion {
        rotation,
        translation,
    };
    Edit::Place(object, motion)
}

fn edits() -> Vec<Edit> {
    let waves = Edit::Material(1, MaterialEdit::Waves(Some(ripples())));
    vec![
        strength(0, 0.3),
        strength(2, 1e9),
        strength(1, 0.7),
        position(0, dvec3(0.1, 2.7, -0.3)),
        position(2, DVec3::ZERO),
        direction(1, dvec3(0.0, -7.0, 1.0)),
        direction(2, DVec3::NEG_Y),
        colour(1.0),
        sphere(0, 0.1),
        disc(1, PI),
        sphere(2, 1.0 / 3.0),
        strength(3, 0.7),
        position(3, DVec3::Y),
        strength(4, 1e9),
        strength(5, 0.1),
        ior(1, 1.7),
        tint(0, 0.1),
        roughness(1, 0.9),
        roughness(0, 0.1),
        waves,
        moved(1, DQuat::IDENTITY, dvec3(0.1, 0.0, 1.0 / 3.0)),
        moved(1, DQuat::from_rotation_x(0.3), DVec3::X),
    ]
}

/// Everything that edits can reach, as text: numbers are written so that different bits differ.
fn image(scene: &Scene) -> String {
    format!("{:?} {:?} {:?}", scene.lights, scene.materials, scene.objects)
}

#[test]
fn edits_undo_bit_for_bit_and_share_what_they_leave() {
    let scene = scene();
    let before = image(&scene);
    let mesh = |scene: &Scene, object: usize| Arc::clone(scene.objects[object].mesh_in_scene());
    for edit in edits() {
        let edited = edit.apply(&scene).expect("it is in range");
        assert!(image(&scene) == before);
        assert_ne!(image(&edited), before, "{edit:?} changes something");
        let restored = EditState::of(&scene).set(&edited);
        assert!(image(&restored) == before, "{edit:?}");
        let repeated = EditState::of(&edited).set(&restored);
        assert!(image(&repeated) == image(&edited), "{edit:?}");

        assert!(Arc::ptr_eq(&edited.textures[0], &scene.textures[0]));
        assert!(Arc::ptr_eq(&mesh(&edited, 0), &mesh(&scene, 0)));
        let moves = matches!(&edit, Edit::Place(..));
        assert_eq!(
            Arc::ptr_eq(&mesh(&edited, 1), &mesh(&scene, 1)),
            !moves,
            "{edit:?}"
        );
        // A movement that is taken back gives the old mesh itself.
        assert!(Arc::ptr_eq(&mesh(&restored, 1), &mesh(&scene, 1)));
    }
}

#[test]
fn roughness_changes_the_class() {
    let scene = scene();
    let pane = Material {
        surface: SurfaceKind::ThinWall,
        volume: None,
        ..parts::dielectric("pane", 1.5)
    };
    // Unlit: smooth by its factors, matte because the file says so.
    let unlit = with(parts::mirror(), |it| it.surface = SurfaceKind::Diffuse);
    let [floor, glass] = [0, 1].map(|material| scene.materials[material].clone());
    for (material, to, expected) in [
        (&glass, 0.3, SurfaceKind::Dielectric),
        (&glass, 1.0, SurfaceKind::Dielectric),
        (&floor, 0.3, SurfaceKind::Coated),
        (&parts::mirror(), 0.2, SurfaceKind::Mirror),
        (&parts::mirror(), 0.5, SurfaceKind::Mirror),
        (&parts::mirror(), 0.7, SurfaceKind::Diffuse),
        (&pane, 0.2, SurfaceKind::ThinWall),
        (&unlit, 0.1, SurfaceKind::Diffuse),
    ] {
        let mut scene = scene.clone();
        scene.materials[0] = material.clone();
        let edited = roughness(0, to).apply(&scene).expect("it is in range");
        assert_eq!(edited.materials[0].surface, expected, "{} at {to}", material.name);
    }
}

#[test]
fn edits_out_of_range_are_refused() {
    let scene = scene();
    let nan = f64::NAN;
    let turned = |x, w| moved(0, DQuat::from_xyzw(x, 0.0, 0.0, w), DVec3::ZERO);
    let shifted = |object, x| moved(object, DQuat::IDENTITY, DVec3::X * x);
    let sizeless = Edit::Light(3, LightEdit::Size(LightSize::None));
    let added = |change: fn(&mut Light)| {
        let mut lamp = parts::point_light("new", DVec3::Y, Flux(1.0));
        change(&mut lamp);
        Edit::AddLight(Arc::new(lamp))
    };
    for (edit, part) in [
        (strength(6, 1.0), "light 6"),
        (strength(3, 0.0), "light `large`"),
        (strength(5, nan), "light `large`"),
        (sphere(0, 0.0), "a radius above 0 m"),
        (sphere(0, nan), "a radius above 0 m"),
        (disc(0, 0.1), "a radius above 0 m"),
        (disc(1, 3.2), "up to π for suns"),
        (sphere(1, 0.1), "up to π for suns"),
        (sizeless, "light `large`"),
        (
            added(|lamp| lamp.size = LightSize::Radius { radius_m: -0.1 }),
            "a radius above 0 m",
        ),
        (
            added(|lamp| lamp.size = LightSize::Angle { diameter_rad: 0.1 }),
            "a radius above 0 m",
        ),
        (added(|lamp| lamp.colour = rgb(-1.0, 3.0, 3.0)), "colour"),
        (strength(0, nan), "light `light`"),
        (strength(0, -1.0), "light `light`"),
        (strength(0, 0.0), "light `light`"),
        (strength(0, f64::INFINITY), "light `light`"),
        (strength(1, -1.0), "strength of -1"),
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
        (ior(9, 1.5), "material 9"),
        // A sky would still be seen.
        (Edit::RemoveLight(5), "large"),
        (Edit::RemoveLight(9), ""),
    ] {
        let error = edit.apply(&scene).expect_err("it is out of range");
        assert_eq!(error.kind, ErrorKind::Usage);
        says(error, part);
    }
}
