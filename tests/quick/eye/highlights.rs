//! Lamps, seen directly and in mirrors: they keep their energy, and rough mirrors show them as sampled microfacets do.

use nephroid::eye_pass::reference::ReferenceSettings;
use nephroid::scene::{Environment, PanelShape};
use nephroid::transport::{EffectSet, NormalSource, ggx_reflection};

use crate::prelude::*;
use support::chain_laws::direction;
use support::meshes::{floor, quad};
use support::scenes::{lamps_of_all_kinds, let_glow, point_light, scene, seen, sun, under_sky, view};

/// Where bulbs and panels are [m].
const LAMP: DVec3 = dvec3(0.1, 1.0, -1.3);
const COLOUR: LinearSrgb = rgb(0.9, 0.7, 0.5);

fn mirror(roughness: f64) -> Material {
    with(parts::mirror(), |it| {
        (it.base_colour, it.roughness) = (COLOUR, roughness);
    })
}

/// Radiance of a lamp along a ray [W/(m² sr)].
fn lamp_along(lamp: &Light, ray: &Ray) -> f64 {
    match (lamp.kind, lamp.size) {
        (LightKind::Point { position, intensity }, LightSize::Radius { radius_m }) => {
            let offset = (position - ray.origin).cross(ray.direction).length();
            if offset < radius_m {
                intensity.0 / (PI * radius_m * radius_m)
            } else {
                0.0
            }
        }
        (
            LightKind::Sun {
                direction,
                normal_irradiance,
            },
            LightSize::Angle { diameter_rad },
        ) => {
            let is_met = -direction.dot(ray.direction) > (0.5 * diameter_rad).cos();
            let solid = PI * (0.5 * diameter_rad).sin().powi(2);
            if is_met { normal_irradiance.0 / solid } else { 0.0 }
        }
        (
            LightKind::Panel {
                centre,
                across,
                down,
                shape,
                radiance,
            },
            _,
        ) => {
            let normal = across.cross(down);
            let distance = (centre - ray.origin).dot(normal) / ray.direction.dot(normal);
            let at = ray.origin + ray.direction * distance - centre;
            let place = [across, down].map(|axis| at.dot(axis) / axis.length_squared());
            let is_met = match shape {
                PanelShape::Rectangle => place.iter().all(|along| along.abs() < 1.0),
                PanelShape::Disc => place[0].hypot(place[1]) < 1.0,
            };
            let shines = distance > 0.0 && ray.direction.dot(normal) < 0.0;
            if is_met && shines { radiance.0 } else { 0.0 }
        }
        other => panic!("no such lamp here: {other:?}"),
    }
}

/// Smith's Λ of GGX.
fn hidden(direction: DVec3, normal: DVec3, alpha: f64) -> f64 {
    let cosine = direction.dot(normal);
    let tangent_squared = (1.0 - cosine * cosine) / (cosine * cosine);
    0.5 * ((1.0 + alpha * alpha * tangent_squared).sqrt() - 1.0)
}

/// Radiance along a ray by reflection at many microfacets, drawn among those that the eye sees.
fn sampled(tracer: &Tracer, lamp: &Light, ray: &Ray, alpha: f64, shift: DVec2) -> LinearSrgb {
    const SIDE: u32 = 128;
    let hit = tracer.closest_hit(ray).expect("the mirror fills the picture");
    let mut sum = LinearSrgb::BLACK;
    for sample in 0..SIDE * SIDE {
        let cell = dvec2(f64::from(sample % SIDE), f64::from(sample / SIDE));
        let at = (cell / f64::from(SIDE) + shift).fract();
        let met = tracer.interact_with(
            EffectSet::EVERYTHING,
            &hit,
            ray.direction,
            &MediumStack::default(),
            Some(at),
        );
        let reflection = met.reflection.expect("a mirror reflects");
        let NormalSource::Micro(facet) = reflection.by else {
            panic!("{reflection:?}");
        };
        // What a microfacet sends into the surface is left out: the light pass mirrors it out again.
        let micro = facet.normal(ray.direction, DVec3::Y);
        let direction = ray.direction.reflect(micro);
        let radiance = lamp_along(lamp, &reflection.ray);
        if radiance > 0.0 && direction.y > 0.0 {
            let [eye, light] = [-ray.direction, direction].map(|it| hidden(it, DVec3::Y, alpha));
            sum += reflection.share * (radiance * (1.0 + eye) / (1.0 + eye + light));
        }
    }
    sum / f64::from(SIDE * SIDE)
}

/// Sums over all channels of two pictures: of their differences, and of each.
fn compared(found: &[[f32; 3]], expected: &[[f64; 3]]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        let found = f64::from(*found);
        for (sum, part) in sums.iter_mut().zip([(found - expected).abs(), found, *expected]) {
            *sum += part;
        }
    }
    sums
}

/// The samples' own noise is up to 0.06 of a picture; the rest is that lamps are wide beside the narrowest lobe.
#[test]
fn rough_mirrors_show_lamps_as_their_microfacets_do() {
    let view = view(dvec3(0.0, 0.9, 1.2), DVec3::ZERO, 0.7, [12, 9]);
    for lamp in lamps_of_all_kinds(LAMP) {
        for roughness in [0.2, 0.35, 0.5_f64] {
            let with_roughness = |roughness: f64| {
                let parts = vec![(floor(50.0, 0.0), mirror(roughness))];
                Tracer::new(Arc::new(scene(parts, vec![lamp.clone()])))
            };
            let tracer = with_roughness(roughness);
            let at = |pixel: usize| {
                let (origin, direction) = (view.camera.position, direction(&view, pixel));
                // Another grid of samples for each pixel.
                let shift = dvec2(0.754_877_666, 0.569_840_291) * pixel as f64;
                sampled(
                    &tracer,
                    &lamp,
                    &Ray { origin, direction },
                    roughness * roughness,
                    shift,
                )
                .to_array()
            };
            let expected: Vec<[f64; 3]> = (0..12 * 9).map(at).collect();
            let shown = |tracer: &Tracer| seen(tracer, &[], &view, &ReferenceSettings::default()).0;
            let [off, found, sum] = compared(&shown(&tracer).radiance, &expected);
            let what = format!("{:?} at {roughness}: {} {}", lamp.kind, off / sum, found / sum);
            assert!(off / sum < 0.1 && (found / sum - 1.0).abs() < 0.05, "{what}");
            // The comparison sees another roughness.
            let [off, _, sum] = compared(&shown(&with_roughness(1.2 * roughness)).radiance, &expected);
            assert!(off / sum > 0.2, "{what}: {}", off / sum);
        }
    }
}

/// Rays see a lamp that is wider than the lobe, but around its image the tails of the lobe are smooth: the mean over
/// points of the lamp.
#[test]
fn narrow_lobes_have_smooth_tails() {
    let view = view(dvec3(0.0, 0.9, 1.2), dvec3(0.02, 0.0, 0.01), 0.4, [80, 60]);
    let (roughness, radius_m, intensity): (f64, f64, f64) = (0.09, 0.04, 2.0);
    let bulb = lamps_of_all_kinds(LAMP).swap_remove(0);
    let parts = vec![(floor(50.0, 0.0), mirror(roughness))];
    let tracer = Tracer::new(Arc::new(scene(parts, vec![bulb])));
    let shown = seen(&tracer, &[], &view, &ReferenceSettings::default())
        .0
        .radiance;
    let (mut off, mut sum) = (0.0, 0.0);
    for (pixel, found) in shown.iter().enumerate() {
        let (origin, direction) = (view.camera.position, direction(&view, pixel));
        let point = origin - direction * (origin.y / direction.y);
        let (x, y) = (LAMP - point).normalize().any_orthonormal_pair();
        let of_place = |place: DVec2| {
            let offset = LAMP + radius_m * (x * place.x + y * place.y) - point;
            let to_lamp = offset.normalize();
            let response = ggx_reflection(DVec3::Y, -direction, to_lamp, roughness.powi(4));
            let cosine = (to_lamp - direction).normalize().dot(to_lamp);
            let reflectance = 0.7 + 0.3 * (1.0 - cosine).powi(5);
            intensity / offset.length_squared() * response * reflectance
        };
        let places = (0..400).map(|place| dvec2(f64::from(place % 20), f64::from(place / 20)) / 9.5 - 1.0);
        let within: Vec<f64> = places
            .filter(|place| place.length() < 1.0)
            .map(of_place)
            .collect();
        let expected = within.iter().sum::<f64>() / within.len() as f64;
        // Beside the image of the lamp.
        if expected < 0.001 * intensity / (PI * radius_m * radius_m) {
            let ratio = f64::from(found[1]) / expected;
            assert!(expected < 1e-3 || (0.5..2.0).contains(&ratio), "{pixel}: {ratio}");
            off += (f64::from(found[1]) - expected).abs();
            sum += expected;
        }
    }
    assert!(sum > 0.0 && off < 0.1 * sum, "{}", off / sum);
}

/// A glowing sheet and a glowing ball leave the highlights of a panel and of a bulb.
#[test]
fn glowing_objects_have_the_highlights_of_lamps() {
    let view = view(dvec3(0.0, 0.9, 1.2), DVec3::ZERO, 0.7, [24, 18]);
    let [bulb, _, panel, _] = &lamps_of_all_kinds(LAMP)[..] else {
        panic!("they are four");
    };
    let radiance = 2.0 / (PI * 0.04 * 0.04);
    let (across, down) = (DVec3::X * 0.12, dvec3(0.0, 0.1, 0.12));
    let sheet = quad(LAMP - 0.5 * (across + down), across, down);
    for (lamp, mesh, radiance) in [
        (bulb, shapes::sphere(LAMP, 0.04, 4), radiance),
        (panel, sheet, 40.0),
    ] {
        for roughness in [0.2, 0.35, 0.5] {
            let lit = scene(vec![(floor(50.0, 0.0), mirror(roughness))], vec![lamp.clone()]);
            let glowing = with(Material::default(), |it| {
                (it.base_colour, it.emitted_radiance) = (LinearSrgb::BLACK, LinearSrgb::grey(radiance));
            });
            let parts = vec![(floor(50.0, 0.0), mirror(roughness)), (mesh.clone(), glowing)];
            let mut shining = scene(parts, vec![]);
            let_glow(&mut shining, 1, None);
            let [lit, shining] = [lit, shining].map(|scene| {
                let tracer = Tracer::new(Arc::new(scene));
                seen(&tracer, &[], &view, &ReferenceSettings::default())
                    .0
                    .radiance
            });
            let lit: Vec<[f64; 3]> = lit.iter().map(|pixel| pixel.map(f64::from)).collect();
            let [off, _, sum] = compared(&shining, &lit);
            assert!(off < 0.02 * sum, "{:?} at {roughness}: {}", lamp.kind, off / sum);
        }
    }
}

/// A bright spot in the image of a sky leaves the highlight of a sun before the rest of it, which a smooth mirror shows as
/// it is.
#[test]
fn suns_of_skies_have_the_highlights_of_suns() {
    let view = view(dvec3(0.0, 0.9, 1.2), DVec3::ZERO, 0.7, [24, 18]);
    let (width, height, column, row) = (256, 128, 3, 40);
    let image = |spot: f32| {
        let mut pixels = vec![[0.5, 0.7, 1.0]; width * height];
        pixels[row * width + column] = [spot; 3];
        Environment::new(width, height, pixels).expect("a sound image")
    };
    let sky = |image: Environment, roughness: f64| {
        let lit = scene(vec![(floor(50.0, 0.0), mirror(roughness))], vec![]);
        under_sky(lit, Some(image), 1.0)
    };
    let turned = |index: usize, count: usize| (index as f64 + 0.5) / count as f64;
    let (polar, azimuth) = (turned(row, height) * PI, turned(column, width) * TAU);
    let to_sun = dvec3(
        polar.sin() * azimuth.sin(),
        polar.cos(),
        -polar.sin() * azimuth.cos(),
    );
    let solid_angle_sr = TAU / width as f64 * PI / height as f64 * polar.sin();
    for roughness in [0.25, 0.35, 0.5] {
        let seen = |scene: Scene| {
            let tracer = Tracer::new(Arc::new(scene));
            seen(&tracer, &[], &view, &ReferenceSettings::default())
                .0
                .radiance
        };
        let found = seen(sky(image(2e5), roughness));
        let mut lit = sky(image(0.7), roughness);
        let mut lamp = sun(-to_sun, 2e5 * solid_angle_sr);
        lamp.size = LightSize::Angle { diameter_rad: 0.08 };
        lit.lights.push(lamp);
        let expected: Vec<[f64; 3]> = seen(lit).iter().map(|pixel| pixel.map(f64::from)).collect();
        let [off, _, sum] = compared(&found, &expected);
        assert!(off < 0.01 * sum, "{roughness}: {}", off / sum);
        // The highlight is most of what is seen.
        let [off, ..] = compared(&seen(sky(image(0.7), roughness)), &expected);
        assert!(off > 0.3 * sum, "{roughness}: {}", off / sum);
    }
}

/// Irradiance of a plane at the eye that faces the view [W/m²], by the solid angle of each pixel.
fn at_the_eye(tracer: &Tracer, view: &View) -> f64 {
    let picture = seen(tracer, &[], view, &ReferenceSettings::default()).0;
    let height = f64::from(view.height);
    let side = 2.0 * (0.5 * view.camera.vertical_fov_rad).tan() / height;
    let of_pixel = |(pixel, radiance): (usize, &[f32; 3])| {
        let cosine = direction(view, pixel).dot(view.camera.forward);
        f64::from(radiance[1]) * side * side * cosine.powi(4)
    };
    picture.radiance.iter().enumerate().map(of_pixel).sum()
}

/// From 20 to 400 pixels across, whatever the size of the lamp's image, and on average over where it lies in its pixels.
#[test]
fn images_of_lamps_keep_their_energy() {
    let unsized_lamps = [point_light(LAMP, 2.0), sun(dvec3(0.0, -0.6, 0.8), 3.0)];
    for lamp in lamps_of_all_kinds(LAMP).into_iter().chain(unsized_lamps) {
        assert_energy(&lamp, true, &|shift| {
            (dvec3(shift, 0.9, 1.2), dvec3(-shift, 0.0, 0.0))
        });
    }
}

#[test]
fn lamps_keep_their_energy_before_the_eye() {
    for lamp in lamps_of_all_kinds(LAMP) {
        // Over a pixel of the smallest picture, across and down.
        assert_energy(&lamp, false, &|shift| {
            let aside = dvec3(1.9 * shift, 0.09 * (shift / 0.004).fract(), 0.0);
            (dvec3(0.0, 0.2, 0.5), LAMP + aside)
        });
    }
    // Points have no size that could be seen.
    for lamp in [point_light(LAMP, 2.0), sun(dvec3(0.0, -0.6, 0.8), 3.0)] {
        let tracer = Tracer::new(Arc::new(scene(vec![], vec![lamp])));
        let view = view(dvec3(0.0, 0.2, 0.5), LAMP, 0.9, [100, 100]);
        assert_eq!(at_the_eye(&tracer, &view), 0.0);
    }
}

/// A lamp, or its image in a floor that mirrors, from eyes that look at targets, both by a shift [m].
fn assert_energy(lamp: &Light, is_mirrored: bool, eye_and_target: &dyn Fn(f64) -> (DVec3, DVec3)) {
    for (size, places) in [(20, 40), (100, 10), (400, 2)] {
        let parts = vec![(floor(50.0, 0.0), mirror(0.0))];
        let tracer = Tracer::new(Arc::new(scene(parts, vec![lamp.clone()])));
        let mut ratio = 0.0;
        for place in 0..places {
            let (eye, target) = eye_and_target(0.05 * f64::from(place) / f64::from(places));
            let view = view(eye, target, 0.9, [size, size]);
            let expected = expected_at(lamp, &view, is_mirrored);
            ratio += at_the_eye(&tracer, &view) / expected / f64::from(places);
        }
        near(ratio, 1.0, 0.03, (&lamp.kind, size));
    }
}

/// Irradiance that a lamp or its image brings to a plane at the eye that faces the view [W/m²].
fn expected_at(lamp: &Light, view: &View, is_mirrored: bool) -> f64 {
    let mirrored = |it: DVec3| dvec3(it.x, if is_mirrored { -it.y } else { it.y }, it.z);
    let eye = view.camera.position;
    let (to_image, irradiance) = match lamp.kind {
        LightKind::Sun {
            direction,
            normal_irradiance,
        } => (mirrored(-direction), normal_irradiance.0),
        LightKind::Point { position, intensity } => {
            let offset = mirrored(position) - eye;
            (offset.normalize(), intensity.0 / offset.length_squared())
        }
        LightKind::Panel {
            centre,
            across,
            down,
            shape,
            radiance,
        } => {
            let offset = mirrored(centre) - eye;
            let area = across.cross(down).length() * if shape == PanelShape::Disc { PI } else { 4.0 };
            let slope = mirrored(across.cross(down).normalize())
                .dot(offset.normalize())
                .abs();
            (
                offset.normalize(),
                radiance.0 * area * slope / offset.length_squared(),
            )
        }
        other => panic!("no such lamp here: {other:?}"),
    };
    let grazing = (1.0 - to_image.y.abs()).powi(5);
    let reflectance = if is_mirrored { 0.7 + 0.3 * grazing } else { 1.0 };
    irradiance * reflectance * to_image.dot(view.camera.forward)
}

/// A screen between lamp and mirror leaves no highlight, at any roughness; nor does one behind the lamp take it away.
#[test]
fn highlights_have_shadows() {
    let view = view(dvec3(0.0, 0.9, 1.2), DVec3::ZERO, 0.5, [12, 9]);
    let most = |roughness: f64, lamp: &Light, towards: f64| {
        let middle = LAMP * towards;
        let screen = quad(middle - dvec3(1.0, 0.0, 0.6), DVec3::X * 2.0, DVec3::Z * 1.2);
        let parts = vec![
            (floor(50.0, 0.0), mirror(roughness)),
            (screen, Material::default()),
        ];
        let tracer = Tracer::new(Arc::new(scene(parts, vec![lamp.clone()])));
        let picture = seen(&tracer, &[], &view, &ReferenceSettings::default()).0;
        picture.radiance.iter().flatten().copied().fold(0.0, f32::max)
    };
    for lamp in lamps_of_all_kinds(LAMP)
        .iter()
        .filter(|lamp| !matches!(lamp.kind, LightKind::Sun { .. }))
    {
        for roughness in [0.0, 0.2, 0.5] {
            assert_eq!(most(roughness, lamp, 0.5), 0.0, "{:?} {roughness}", lamp.kind);
            assert!(most(roughness, lamp, 1.2) > 0.1, "{:?} {roughness}", lamp.kind);
        }
    }
}
