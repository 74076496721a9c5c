//! Studies: tables and plots that say what they hold, references with their noise, nothing half-written.

use nephroid::export::FloatImage;

use crate::program::{Run, Sandbox};

const TINY: &str =
    "study convergence builtin:mirror -o out --densities 1e3,1e4 --repeat 1 --map-resolution 32";

/// Columns of a table and its rows, by name.
fn read_table(sandbox: &Sandbox, file: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(sandbox.path(file)).expect("a table");
    let row = |record: &csv::StringRecord| record.iter().map(str::to_string).collect::<Vec<String>>();
    let header = row(reader.headers().expect("a header"));
    let rows = reader.records().map(|record| row(&record.expect("a row")));
    (header, rows.collect())
}

fn column(table: &(Vec<String>, Vec<Vec<String>>), name: &str) -> Vec<String> {
    let index = table.0.iter().position(|column| column == name);
    let index = index.unwrap_or_else(|| panic!("no column {name} in {:?}", table.0));
    table.1.iter().map(|row| row[index].clone()).collect()
}

fn numbers(table: &(Vec<String>, Vec<Vec<String>>), name: &str) -> Vec<f64> {
    let parse = |text: String| text.parse().unwrap_or_else(|_| panic!("{name} is {text}"));
    column(table, name).into_iter().map(parse).collect()
}

fn rmse(run: &Run) -> f64 {
    run.json()["relative_rmse"].as_f64().expect("an error")
}

#[test]
fn studies_are_listed_and_have_to_be_named() {
    let sandbox = Sandbox::new();
    let list = sandbox.succeed("study --list");
    for study in ["convergence", "reference", "effects", "spectrum", "stability"] {
        assert!(list.stdout.contains(study), "{}", list.stdout);
    }
    assert_eq!(
        sandbox.succeed("study --list --json").json()[0]["name"],
        "convergence"
    );
    for (line, word) in [
        ("study", "--list"),
        ("study rainbows -o out", "rainbows"),
        ("study convergence", "--output"),
        ("study convergence -o out --densities 1e4,1e3", "ascending"),
        ("study convergence -o out --densities 0", "--densities"),
        ("study convergence -o out --densities few", "--densities"),
        ("study convergence -o out --repeat 0", "--repeat"),
        ("study convergence -o out --quick --repeat 3", "--quick"),
        ("study convergence -o out --surface floor", "--reference"),
        (
            "study convergence -o out --map-resolution auto",
            "--map-resolution",
        ),
        ("study convergence -o out --estimators guess", "guess"),
        ("study reference builtin:ring -o out", "--rays"),
        ("study reference builtin:ring -o out --rays 10", "--rays"),
        ("study reference builtin:ring -o out --rays -1", "--rays"),
        (
            "study reference builtin:ring -o out --rays 1e4 --map-resolution auto",
            "--map-resolution",
        ),
        ("study stability", "--output"),
        ("study stability -o out --case rainbow", "focus-paraboloid"),
        ("study stability -o out --threads many", "--threads"),
        ("study effects -o out", "SCENE"),
        ("study effects builtin:ball", "--output"),
        ("study effects builtin:ball -o out --repeat 0", "--repeat"),
        ("study effects builtin:ball -o out --repeat -1", "--repeat"),
        ("study effects builtin:ball -o out --max-time 1s", "--max-time"),
        ("study effects builtin:ball -o out --density -5", "--density"),
        ("study effects builtin:ball -o out --layers ambient", "--layers"),
        (
            "study effects builtin:ball -o out --effects indirect=maybe",
            "indirect",
        ),
        (
            "study effects builtin:ball -o out --effects sparkle=off",
            "sparkle",
        ),
        (
            "study effects builtin:ball -o out --footprint disc",
            "--footprint",
        ),
    ] {
        sandbox.run(line).failed_in_one_sentence(2, &[word]);
    }
    assert!(sandbox.files(".").is_empty(), "bad usage writes nothing");
}

#[test]
fn convergence_writes_a_row_per_estimator_and_density() {
    let sandbox = Sandbox::new();
    let run = sandbox.succeed(TINY);
    assert_eq!(sandbox.files("out"), ["convergence.csv", "convergence.svg"]);
    let table = read_table(&sandbox, "out/convergence.csv");
    let estimators = column(&table, "estimator");
    for estimator in ["splat", "wavefront"] {
        let rows = estimators.iter().filter(|name| *name == estimator).count();
        assert_eq!(rows, 2, "{estimator} at two densities");
        assert!(run.stdout.contains(estimator), "{}", run.stdout);
    }
    assert!(
        column(&table, "reference")
            .iter()
            .all(|kind| kind == "analytic S5")
    );
    for (name, low, high) in [
        ("rays", 1.0, 1e6),
        ("cpu_light_pass_s", 1e-9, 1e3),
        ("relative_rmse", 1e-9, 1.0),
        ("ard", 1e-9, 1.0),
        ("peak_ratio", 0.3, 3.0),
        ("flux_ratio", 0.9, 1.1),
    ] {
        for value in numbers(&table, name) {
            assert!((low..high).contains(&value), "{name} is {value}");
        }
    }
    let plot = std::fs::read_to_string(sandbox.path("out/convergence.svg")).expect("a plot");
    assert!(plot.starts_with("<svg") && plot.trim_end().ends_with("</svg>"));
    for word in ["splat", "wavefront", "light rays", "relative RMSE", "analytic S5"] {
        assert!(plot.contains(word), "no {word} in the plot");
    }
}

#[test]
fn its_errors_are_those_that_compare_prints() {
    let sandbox = Sandbox::new();
    sandbox.succeed(TINY);
    let table = read_table(&sandbox, "out/convergence.csv");
    let row = column(&table, "estimator")
        .iter()
        .zip(numbers(&table, "density"))
        .position(|(name, density)| name == "splat" && density > 5e3)
        .expect("a row");
    sandbox.succeed("bake builtin:mirror -o maps --estimator splat --density 1e4 --map-resolution 32");
    let reference = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/reference/S5.pfm");
    let manifest = sandbox.manifest("maps");
    let file = manifest["maps"][0]["file"].as_str().expect("a path").to_string();
    let expected = rmse(&sandbox.succeed(&format!("compare maps/{file} {reference} --json")));
    let measured = numbers(&table, "relative_rmse")[row];
    assert!(
        (measured / expected - 1.0).abs() < 1e-6,
        "{measured}, not {expected}"
    );
    // The same from a reference that is given.
    sandbox.succeed(&format!(
        "study convergence builtin:mirror -o given --densities 1e4 --estimators splat --quick --map-resolution 32 \
         --reference {reference} --surface floor"
    ));
    let given = numbers(&read_table(&sandbox, "given/convergence.csv"), "relative_rmse");
    assert!(
        (given[0] / expected - 1.0).abs() < 1e-6,
        "{given:?}, not {expected}"
    );
}

#[test]
fn a_scene_without_reference_is_measured_against_a_finer_bake() {
    let sandbox = Sandbox::new();
    let run = sandbox.succeed(
        "study convergence builtin:showroom -o out --densities 1e2,1e3 --estimators splat --quick \
         --map-resolution 16 --json",
    );
    let document = run.json();
    let reference = document["reference"].as_str().expect("a reference");
    assert!(reference.starts_with("self splat"), "{reference}");
    assert_eq!(document["costs"].as_array().map(Vec::len), Some(3));
    let error = |row: usize| {
        document["measurements"][row]["relative_rmse"]
            .as_f64()
            .expect("an error")
    };
    assert!(error(1) < error(0), "{} then {}", error(0), error(1));
}

#[test]
fn what_cannot_be_studied_is_said_and_writes_nothing() {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("photos")).expect("writable");
    sandbox.write("photos/cat.jpg", "a cat");
    sandbox.write("odd.pfm", "Pf\n3 3\n-1.0\nabcdabcdabcdabcdabcdabcdabcdabcdabcd");
    for (line, words) in [
        (
            "study convergence builtin:mirror -o photos --quick",
            vec!["photos", "--force"],
        ),
        (
            "study convergence missing.glb -o new --quick",
            vec!["missing.glb"],
        ),
        (
            "study convergence builtin:mirror -o new --reference missing.pfm",
            vec!["missing.pfm"],
        ),
        (
            "study convergence builtin:mirror -o new --densities 1e2 --quick --reference odd.pfm",
            vec!["odd.pfm", "multiples"],
        ),
        (
            "study convergence builtin:mirror -o new --reference odd.pfm --surface cellar",
            vec!["cellar", "--surface"],
        ),
        (
            "study reference builtin:mirror -o photos --rays 1e4",
            vec!["photos", "--force"],
        ),
    ] {
        sandbox.run(line).failed_in_one_sentence(1, &words);
    }
    assert_eq!(sandbox.files("."), ["odd.pfm", "photos"]);
    assert_eq!(sandbox.files("photos"), ["cat.jpg"]);
}

#[test]
fn an_earlier_study_is_replaced() {
    let sandbox = Sandbox::new();
    let line = "study convergence builtin:mirror -o out --estimators splat --quick --map-resolution 16";
    sandbox.succeed(&format!("{line} --densities 1e2"));
    sandbox.write("out/notes.txt", "keep me");
    sandbox.succeed(&format!("{line} --densities 1e2,1e3"));
    assert_eq!(read_table(&sandbox, "out/convergence.csv").1.len(), 2);
    assert_eq!(
        sandbox.files("out"),
        ["convergence.csv", "convergence.svg", "notes.txt"]
    );
}

#[test]
fn references_are_maps_that_know_their_noise() {
    let sandbox = Sandbox::new();
    let run = sandbox.succeed("study reference builtin:mirror -o out --rays 2e5 --map-resolution 32 --json");
    assert_eq!(sandbox.files("out"), ["manifest.json", "maps", "reference.json"]);
    let noise = run.json()["noise"].as_f64().expect("a noise");
    let manifest = sandbox.manifest("out");
    let file = manifest["maps"][0]["file"].as_str().expect("a path").to_string();
    let analytic = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/reference/S5.pfm");
    let error = rmse(&sandbox.succeed(&format!("compare out/{file} {analytic} --json")));
    assert!(
        (0.75..1.33).contains(&(error / noise)),
        "off by {error}, but the noise is said to be {noise}"
    );
    // A folder of maps as any other.
    sandbox.succeed("render builtin:mirror -o picture.png --maps out --backend cpu --size 32x18");
}

/// Luminance on all maps of a bake [W]; for maps whose texels are all of one size.
fn watts(sandbox: &Sandbox, folder: &str) -> f64 {
    let manifest = sandbox.manifest(folder);
    let maps = manifest["maps"].as_array().expect("maps");
    maps.iter()
        .map(|map| {
            let file = map["file"].as_str().expect("a path");
            let image = FloatImage::read(&sandbox.path(folder).join(file)).expect("a map");
            let sum: f64 = image.luminance("").expect("R, G, B").values.iter().sum();
            sum * map["texel_area_m2"].as_f64().expect("an area")
        })
        .sum()
}

#[test]
fn effects_are_worth_what_the_maps_say() {
    const QUICK: &str = "--density 1e3 --map-resolution 32";
    let sandbox = Sandbox::new();
    let run = sandbox.succeed(&format!(
        "study effects builtin:ball -o out {QUICK} --repeat 2 --json"
    ));
    assert_eq!(
        sandbox.files("out"),
        [
            "difference_light_pass.png",
            "difference_reflection.png",
            "difference_refraction.png",
            "effects.csv"
        ]
    );
    let table = read_table(&sandbox, "out/effects.csv");
    let names = column(&table, "effect");
    assert_eq!(
        names,
        ["light_pass", "refraction", "reflection", "everything forced on"]
    );
    let [with, without, worth] = ["with_w", "without_w", "difference_w"].map(|name| numbers(&table, name));

    sandbox.succeed(&format!("bake builtin:ball -o with {QUICK}"));
    sandbox.succeed(&format!(
        "bake builtin:ball -o without {QUICK} --effects refraction=off"
    ));
    let expected = watts(&sandbox, "with") - watts(&sandbox, "without");
    assert!(expected > 1.0, "{expected} W");
    assert!(
        (worth[1] / expected - 1.0).abs() < 1e-6,
        "{worth:?}, not {expected}"
    );
    for row in 0..4 {
        assert!((with[row] - without[row] - worth[row]).abs() < 1e-12);
    }
    assert_eq!(without[0], 0.0, "no light pass, no light");

    // Forced on, other code gives the same maps.
    let differences = numbers(&table, "relative_rmse");
    assert_eq!((differences[3], worth[3]), (0.0, 0.0));
    assert!(differences[..3].iter().all(|rmse| *rmse > 0.0), "{differences:?}");
    for name in ["rays", "bytes", "cpu_with_s", "cpu_without_s"] {
        let sizes = numbers(&table, name);
        assert!(sizes.iter().all(|size| *size > 0.0), "{name}: {sizes:?}");
    }
    // What leaves the ball last refracted.
    let deposits = numbers(&table, "deposits");
    assert!(deposits[1] > 0.0 && deposits[0] == deposits[3], "{deposits:?}");
    let document = run.json();
    let forced = &document["everything_forced_on"];
    for ratio in ["cpu_ratio", "rays_ratio"] {
        let ratio = forced[ratio].as_f64().expect("a ratio");
        assert!(ratio > 0.1 && ratio < 10.0, "{ratio}");
    }
    assert_eq!(document["effects"][1]["picture"]["surface"], "floor");
    assert_eq!(document["effects"][1]["difference_w"].as_f64(), Some(worth[1]));
}

#[test]
fn pictures_of_effects_are_warm_where_light_is_added() {
    const QUICK: &str = "--density 1e3 --map-resolution 16 --repeat 1";
    let sandbox = Sandbox::new();
    let run = sandbox.succeed(&format!(
        "study effects builtin:mirror -o out {QUICK} --layers caustic,direct"
    ));
    for effect in ["light_pass", "reflection", "direct", "everything forced on"] {
        assert!(run.stdout.contains(effect), "no {effect} in {}", run.stdout);
    }
    for effect in ["reflection", "direct"] {
        let picture = image::open(sandbox.path(&format!("out/difference_{effect}.png"))).expect("a PNG");
        let picture = picture.to_rgb8();
        assert_eq!((picture.width(), picture.height()), (16, 16));
        let warmest = picture
            .pixels()
            .map(|pixel| i32::from(pixel.0[0]) - i32::from(pixel.0[2]));
        assert!(warmest.max() > Some(50), "{effect} adds light");
    }
    // A later study without an effect leaves no picture of it behind, and other files alone.
    sandbox.write("out/notes.txt", "keep me");
    sandbox.succeed(&format!("study effects builtin:mirror -o out {QUICK}"));
    assert_eq!(
        sandbox.files("out"),
        [
            "difference_light_pass.png",
            "difference_reflection.png",
            "effects.csv",
            "notes.txt"
        ]
    );
    std::fs::create_dir(sandbox.path("photos")).expect("a folder");
    sandbox.write("photos/cat.jpg", "a cat");
    sandbox
        .run(&format!("study effects builtin:mirror -o photos {QUICK}"))
        .failed_in_one_sentence(1, &["photos", "--force"]);
}

#[test]
fn the_whole_spectrum_beats_few_wavelengths() {
    let sandbox = Sandbox::new();
    let run = sandbox.succeed(
        "study spectrum builtin:prism -o out --wavelengths 1,7 --density 1.2e7 --map-resolution 128 --repeat 1 --json",
    );
    assert_eq!(sandbox.files("out"), ["spectrum.csv", "spectrum.png"]);
    let table = read_table(&sandbox, "out/spectrum.csv");
    let columns = ["estimator", "sampling", "wavelengths"].map(|name| column(&table, name));
    let ways: Vec<String> = (0..columns[0].len())
        .map(|row| columns.each_ref().map(|column| column[row].clone()).join(" "))
        .collect();
    assert_eq!(
        ways,
        [
            "splat split 1",
            "splat split 7",
            "splat stochastic 1",
            "splat stochastic 7",
            "splat stochastic continuous",
            "wavefront split 1",
            "wavefront split 7",
            "wavefront stochastic 1",
            "wavefront stochastic 7",
            "wavefront interpolated continuous",
        ]
    );
    let [errors, rays, flux] = ["colour_error", "rays", "flux_ratio"].map(|name| numbers(&table, name));
    assert!(rays[1] > 6.0 * rays[0] && rays[3] < 2.0 * rays[2], "{rays:?}");
    assert!(errors[6] < errors[5] && errors[9] < 0.5 * errors[6], "{errors:?}");
    // Dealt out among seven, the lattice has cells wider than the slit, and may miss light between its rays.
    let complete = flux.iter().enumerate().filter(|(way, _)| *way != 8);
    assert!(
        complete.into_iter().all(|(_, flux)| (flux - 1.0).abs() < 0.05),
        "{flux:?}"
    );
    assert_eq!(run.json()["surface"], "wall");
    // Eleven strips of one size, the reference first, each with a line below.
    let strips = image::open(sandbox.path("out/spectrum.png"))
        .expect("a PNG")
        .to_rgb8();
    assert_eq!(strips.height() % 11, 0);
    let strip = strips.height() / 11;
    let colourful = |first: u32| {
        let pixels = (first * strip..(first + 1) * strip - 1)
            .flat_map(|row| (0..strips.width()).map(move |column| (column, row)));
        let spread = pixels.map(|(column, row)| {
            let pixel = strips.get_pixel(column, row).0;
            pixel.iter().max().expect("channels") - pixel.iter().min().expect("channels")
        });
        spread.max().expect("pixels")
    };
    assert!(colourful(0) > 100 && colourful(10) > 100, "spectra are coloured");
    assert!(colourful(6) < 30, "one wavelength leaves a white line");
}

#[test]
fn a_hard_case_is_named_and_its_laws_stand_in_the_table() {
    let sandbox = Sandbox::new();
    let run = sandbox.succeed("study stability -o out --case normal-incidence");
    assert_eq!(sandbox.files("out"), ["stability.csv", "stability.md"]);
    assert!(run.stdout.contains("normal-incidence (optics)"), "{}", run.stdout);
    let table = read_table(&sandbox, "out/stability.csv");
    assert_eq!(column(&table, "case"), ["normal-incidence"]);
    assert_eq!(column(&table, "holds"), ["true"]);
    let (worst, bound) = (numbers(&table, "worst"), numbers(&table, "bound"));
    assert!(worst[0] <= bound[0] && bound[0] <= 1e-6, "{worst:?} of {bound:?}");
    let json = sandbox
        .succeed("study stability -o out --case normal-incidence --json")
        .json();
    assert_eq!(json["broken"].as_array().map(Vec::len), Some(0));
    assert_eq!(json["rows"][0]["law"], column(&table, "law")[0]);
}
