//! `compare`: maps against references whose measures are known.

use crate::prelude::*;
use support::program::Sandbox;

/// What the measures are worth is held beside them; here that they are told.
#[test]
fn measures_of_known_pairs() {
    let sandbox = Sandbox::new();
    sandbox.write_pfm("ones.pfm", 7, 3, |_, _| 1.0);
    sandbox.write_pfm("more.pfm", 7, 3, |_, _| 1.25);
    sandbox.write_pfm("small.pfm", 2, 3, |column, row| (1 + column + 2 * row) as f32);
    // Each texel split in four that average to it.
    sandbox.write_pfm("large.pfm", 4, 6, |column, row| {
        let mean = (1 + column / 2 + 2 * (row / 2)) as f32;
        mean + [0.25, -0.25][(column + row) % 2]
    });
    let more =
        r#"{"relative_rmse": 0.25, "average_relative_difference": 0.25, "flux_ratio": 1.25, "peak": 1.25}"#;
    let same_size = r#"{"relative_rmse": 0, "width": 2, "height": 3}"#;
    for (pair, expected) in [
        ("more.pfm ones.pfm", more),
        ("ones.pfm ones.pfm --max-rmse 0", r#"{"relative_rmse": 0}"#),
        ("large.pfm small.pfm --max-rmse 0", same_size),
        ("small.pfm large.pfm --max-rmse 0", same_size),
    ] {
        let report = sandbox.succeed(&format!("compare {pair} --json")).json();
        for (name, expected) in parsed(expected).as_object().expect("measures") {
            let [found, expected] = [&report[name], expected].map(|value| value.as_f64().expect(name));
            near(found, expected, 1e-12, name);
        }
    }
}

#[test]
fn turned_or_moved_maps_do_not_pass() {
    let sandbox = Sandbox::new();
    let value = |column: usize, row: usize| (1 + column + 10 * row) as f32;
    sandbox.write_pfm("map.pfm", 7, 3, value);
    sandbox.write_pfm("flipped.pfm", 7, 3, |column, row| value(column, 2 - row));
    sandbox.write_pfm("mirrored.pfm", 7, 3, |column, row| value(6 - column, row));
    sandbox.write_pfm("shifted.pfm", 7, 3, |column, row| value((column + 1) % 7, row));
    for wrong in ["flipped", "mirrored", "shifted"] {
        let run = sandbox.run(&format!("compare {wrong}.pfm map.pfm --max-rmse 1"));
        assert_eq!(run.code, 1, "{wrong}");
        assert!(run.stderr.contains("above the limit"), "{}", run.stderr);
        assert!(run.stdout.contains("relative RMSE"), "{}", run.stdout);
    }
}

#[test]
fn the_difference_picture_shows_where() {
    let sandbox = Sandbox::new();
    sandbox.write_pfm("reference.pfm", 3, 1, |_, _| 1.0);
    sandbox.write_pfm("map.pfm", 3, 1, |column, _| [2.0, 1.0, 0.0][column]);
    sandbox.succeed("compare map.pfm reference.pfm --difference difference.png");
    let picture = image::open(sandbox.path("difference.png"))
        .expect("a PNG")
        .to_rgb8();
    assert_eq!(picture.dimensions(), (3, 1));
    let [brighter, equal, darker] = [0, 1, 2].map(|column| picture.get_pixel(column, 0).0);
    assert!(
        brighter[0] == 255 && brighter[1].max(brighter[2]) < 200,
        "{brighter:?}"
    );
    assert_eq!(equal, [255; 3]);
    assert!(darker[2] == 255 && darker[0].max(darker[1]) < 200, "{darker:?}");
}

#[test]
fn a_baked_map_meets_its_reference() {
    let sandbox = Sandbox::new();
    let reference = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/reference/S5.pfm");
    sandbox.succeed("bake builtin:mirror -o out --estimator wavefront --density 1e5 --map-resolution 64");
    let map = "out/maps/0000_floor.exr";
    let run = sandbox.succeed(&format!("compare {map} {reference} --json --max-rmse 5"));
    assert_eq!(run.json()["layer"], json!("caustic"));
    // A wrong layer is refused, not replaced.
    let wrong = sandbox.run(&format!("compare {map} {reference} --layer direct"));
    wrong.failed_in_one_sentence(1, &["caustic.R"]);
}

#[test]
fn what_cannot_be_compared_is_said() {
    let sandbox = Sandbox::new();
    sandbox.write_pfm("ones.pfm", 2, 2, |_, _| 1.0);
    sandbox.write_pfm("odd.pfm", 3, 3, |_, _| 1.0);
    sandbox.write_pfm("dark.pfm", 2, 2, |_, _| 0.0);
    let nan = |column, row| if column + row == 2 { f32::NAN } else { 1.0 };
    sandbox.write_pfm("nan.pfm", 2, 2, nan);
    sandbox.write("short.pfm", "Pf\n2 2\n-1.0\nabc");
    sandbox.write("text.exr", "hello");
    sandbox.write("cut.exr", [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]);
    for (files, words) in rows(
        "ones.pfm dark.pfm => dark.pfm | the reference is dark
         ones.pfm odd.pfm => 2x2 | 3x3 | multiples
         nan.pfm ones.pfm => nan.pfm | column 1, row 1
         short.pfm ones.pfm => short.pfm
         text.exr ones.pfm => text.exr | neither
         cut.exr ones.pfm => cut.exr
         missing.exr ones.pfm => missing.exr
         ones.pfm missing.exr => missing.exr
         ones.pfm ones.pfm --difference no/d.png => no/d.png",
    ) {
        let run = sandbox.run(&format!("compare {files}"));
        run.failed_in_one_sentence(1, &words.split(" | ").collect::<Vec<_>>());
    }
}
