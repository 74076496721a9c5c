//! Maps against references, on pairs whose measures are known.

use crate::program::{Run, Sandbox};

impl Sandbox {
    /// A one-channel PFM; the values are stored in their order.
    fn write_pfm(&self, name: &str, width: usize, height: usize, value: impl Fn(usize, usize) -> f32) {
        let mut bytes = format!("Pf\n{width} {height}\n-1.0\n").into_bytes();
        for row in 0..height {
            for column in 0..width {
                bytes.extend(value(column, row).to_le_bytes());
            }
        }
        self.write(name, bytes);
    }
}

fn measure(run: &Run, name: &str) -> f64 {
    run.json()[name]
        .as_f64()
        .unwrap_or_else(|| panic!("{name} in {}", run.stdout))
}

#[test]
fn measures_of_known_pairs() {
    let sandbox = Sandbox::new();
    sandbox.write_pfm("ones.pfm", 7, 3, |_, _| 1.0);
    sandbox.write_pfm("more.pfm", 7, 3, |_, _| 1.25);
    let run = sandbox.succeed("compare more.pfm ones.pfm --json");
    for name in ["relative_rmse", "average_relative_difference"] {
        assert!((measure(&run, name) - 0.25).abs() < 1e-12, "{name}");
    }
    assert!((measure(&run, "flux_ratio") - 1.25).abs() < 1e-12);
    assert!((measure(&run, "peak") - 1.25).abs() < 1e-12);
    let run = sandbox.succeed("compare ones.pfm ones.pfm --json --max-rmse 0");
    assert!(measure(&run, "relative_rmse").abs() < 1e-15);
}

#[test]
fn a_map_that_is_upside_down_or_off_by_a_texel_does_not_pass() {
    let sandbox = Sandbox::new();
    let value = |column: usize, row: usize| (1 + column + 10 * row) as f32;
    sandbox.write_pfm("map.pfm", 7, 3, value);
    sandbox.write_pfm("flipped.pfm", 7, 3, |column, row| value(column, 2 - row));
    sandbox.write_pfm("mirrored.pfm", 7, 3, |column, row| value(6 - column, row));
    sandbox.write_pfm("shifted.pfm", 7, 3, |column, row| value((column + 1) % 7, row));
    sandbox.succeed("compare map.pfm map.pfm --max-rmse 0");
    for wrong in ["flipped", "mirrored", "shifted"] {
        let run = sandbox.run(&format!("compare {wrong}.pfm map.pfm --max-rmse 1"));
        assert_eq!(run.code, 1, "{wrong}");
        assert!(run.stderr.contains("above the limit"), "{}", run.stderr);
        assert!(run.stdout.contains("relative RMSE"), "{}", run.stdout);
    }
}

#[test]
fn the_larger_map_is_averaged_down() {
    let sandbox = Sandbox::new();
    sandbox.write_pfm("small.pfm", 2, 3, |column, row| (1 + column + 2 * row) as f32);
    // Each texel split in four that average to it.
    sandbox.write_pfm("large.pfm", 4, 6, |column, row| {
        let mean = (1 + column / 2 + 2 * (row / 2)) as f32;
        mean + [0.25, -0.25][(column + row) % 2]
    });
    for line in ["compare large.pfm small.pfm", "compare small.pfm large.pfm"] {
        let run = sandbox.succeed(&format!("{line} --json --max-rmse 0"));
        assert_eq!((measure(&run, "width"), measure(&run, "height")), (2.0, 3.0));
    }
    sandbox.write_pfm("odd.pfm", 3, 3, |_, _| 1.0);
    sandbox
        .run("compare small.pfm odd.pfm")
        .failed_in_one_sentence(1, &["2x3", "3x3", "multiples"]);
}

#[test]
fn what_cannot_be_compared_is_said() {
    let sandbox = Sandbox::new();
    sandbox.write_pfm("ones.pfm", 2, 2, |_, _| 1.0);
    sandbox.write_pfm("dark.pfm", 2, 2, |_, _| 0.0);
    sandbox.write_pfm(
        "nan.pfm",
        2,
        2,
        |column, row| if column + row == 2 { f32::NAN } else { 1.0 },
    );
    sandbox.write("short.pfm", "Pf\n2 2\n-1.0\nabc");
    sandbox.write("text.exr", "hello");
    sandbox.write("cut.exr", [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]);
    for (line, words) in [
        ("compare ones.pfm dark.pfm", vec!["dark.pfm", "dark"]),
        ("compare nan.pfm ones.pfm", vec!["nan.pfm", "column 1, row 1"]),
        ("compare short.pfm ones.pfm", vec!["short.pfm"]),
        ("compare text.exr ones.pfm", vec!["text.exr", "neither"]),
        ("compare cut.exr ones.pfm", vec!["cut.exr"]),
        ("compare missing.exr ones.pfm", vec!["missing.exr"]),
        ("compare ones.pfm missing.exr", vec!["missing.exr"]),
        (
            "compare ones.pfm ones.pfm --difference no/d.png",
            vec!["no/d.png"],
        ),
    ] {
        sandbox.run(line).failed_in_one_sentence(1, &words);
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
        brighter[0] == 255 && brighter[1] < 200 && brighter[2] < 200,
        "{brighter:?}"
    );
    assert_eq!(equal, [255; 3]);
    assert!(
        darker[2] == 255 && darker[0] < 200 && darker[1] < 200,
        "{darker:?}"
    );
}

#[test]
fn a_baked_map_meets_the_reference_in_its_place() {
    let sandbox = Sandbox::new();
    let reference = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/reference/S5.pfm");
    sandbox.succeed("bake builtin:mirror -o out --density 1e5 --map-resolution 64");
    let manifest = sandbox.manifest("out");
    let map = manifest["maps"]
        .as_array()
        .expect("maps")
        .iter()
        .find(|map| map["surface"] == "floor")
        .expect("the floor is lit");
    let file = map["file"].as_str().expect("a path");
    let run = sandbox.succeed(&format!("compare out/{file} {reference} --json --max-rmse 5"));
    assert_eq!(run.json()["layer"], "caustic");
    // A wrong layer is refused, not replaced.
    sandbox
        .run(&format!("compare out/{file} {reference} --layer direct"))
        .failed_in_one_sentence(1, &["caustic.R"]);
}
