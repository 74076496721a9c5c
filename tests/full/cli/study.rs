//! Studies: what they write, their laws, and what is refused; and what is kept in the user's cache folder.

use std::collections::BTreeMap;

use nephroid::export::FloatImage;

use support::prelude::*;
use support::program::Sandbox;

const S5: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/reference/S5.pfm");

/// Rows of a study's table, by column.
#[derive(Clone, Debug)]
struct Rows(Vec<BTreeMap<String, Value>>);

impl Rows {
    fn of(&self, column: &str, value: &str) -> Self {
        let rows: Vec<_> = self
            .0
            .iter()
            .filter(|row| row[column] == value)
            .cloned()
            .collect();
        assert!(!rows.is_empty(), "no {value} in {self:?}");
        Self(rows)
    }

    fn words(&self, column: &str) -> Vec<&str> {
        self.0.iter().filter_map(|row| row[column].as_str()).collect()
    }

    fn numbers(&self, column: &str) -> Vec<f64> {
        let number = |row: &BTreeMap<String, Value>| row[column].as_f64();
        let numbers: Option<Vec<f64>> = self.0.iter().map(number).collect();
        numbers.unwrap_or_else(|| panic!("{column} of {self:?}"))
    }

    fn errors(&self) -> Vec<f64> {
        self.numbers("relative_rmse")
    }

    /// d ln(y) / d ln(x) between the first and the last row.
    fn slope(&self, x: &str, y: &str) -> f64 {
        let [x, y] = [x, y].map(|column| self.numbers(column));
        (y[y.len() - 1] / y[0]).ln() / (x[x.len() - 1] / x[0]).ln()
    }
}

fn study(sandbox: &Sandbox, line: &str) -> (Rows, Value) {
    let report = sandbox.succeed(&format!("study {line} --json")).json();
    (rows(sandbox, &report), report)
}

/// The table of a report, whose files are checked.
fn rows(sandbox: &Sandbox, report: &Value) -> Rows {
    let text = |value: &Value| value.as_str().expect("text").to_string();
    let list = |value: &Value| value.as_array().expect("a list").clone();
    let (name, folder) = (text(&report["study"]), text(&report["folder"]));
    let mut files: Vec<String> = list(&report["files"]).iter().map(text).collect();
    files.sort();
    assert_eq!(sandbox.files(&folder), files, "{name} names what it writes");
    let path = |file: &str| sandbox.path(&format!("{folder}/{file}"));
    let read = |file: &str| std::fs::read_to_string(path(file)).expect("text");
    let page = read(&format!("{name}.md"));
    assert!(!page.contains("NaN"), "{page}");
    for file in files.iter().filter(|file| file.ends_with("svg")) {
        assert!(page.contains(file) && read(file).contains("<polyline"), "{file}");
    }
    for file in files.iter().filter(|file| file.ends_with("png")) {
        let picture = image::open(path(file)).expect("a PNG").to_luma8();
        assert_ne!(picture.iter().min(), picture.iter().max(), "{file}");
        assert!(page.contains(file), "{file}");
    }
    let columns: Vec<String> = list(&report["table"]["columns"]).iter().map(text).collect();
    let table = list(&report["table"]["rows"]);
    let csv = read(&format!("{name}.csv"));
    assert_eq!(csv.lines().next(), Some(columns.join(",").as_str()));
    assert_eq!(csv.lines().count(), 1 + table.len());
    let row = |row| columns.iter().cloned().zip(list(row)).collect();
    Rows(table.iter().map(row).collect())
}

/// Study, which of its rows, what of them, and the least and most that it may be: `y ~ x` is the slope of logarithms,
/// `spread y` the largest over the smallest, `y` every value that there is.
const LAWS: &str = "
accuracy | estimator=auto | memory_mb | 1e-9 1e9
accuracy | scene=mirror; estimator=auto | relative_rmse ~ target | 0.2 4
accuracy | scene=pool; estimator=auto | rays_ratio | 0.3 3
accuracy | scene=pool; estimator=auto | relative_rmse ~ target | 0.2 4
accuracy | scene=pool; estimator=auto | rays ~ target | -9 -1e-9
accuracy | scene=mirror; estimator=splat | relative_rmse ~ rays | -1.5 -0.1
accuracy | scene=pool; estimator=splat | relative_rmse ~ rays | -1.5 -0.1
scaling | what=rays | spread segments_per_ray | 1 1.5
scaling | what=triangles | spread segments_per_ray | 1 1.5
scaling | what=rays | memory_mb ~ rays | -9 0.1
scaling | what=threads | spread rays | 1 1
table1 | estimator=splat, as the paper | rays ~ density_per_sr | 0.95 1.05
table1 | estimator=splat, as the paper | paper_rays ~ density_per_sr | 0.99 1.01
table1 | estimator=splat, as the paper | relative_rmse ~ rays | -9 -0.1
table1 | | eye_pass_cpu_s | 1e-9 1e9
rays | estimator=splat, as the paper | relative_rmse ~ rays | -2 -0.15
rays | estimator=splat | relative_rmse ~ rays | -2 -0.15
rays | estimator=auto | relative_rmse ~ rays | -2 -0.1
resolution | estimator=splat | relative_rmse ~ side_texels | 1e-9 9
resolution | estimator=splat | spread rays | 1 1
kernels | | paper_rms | 1e-9 1e9
connectivity | estimate=nearest hits | relative_rmse | 0.01 2
item-buffer | | flux_ratio | 0.97 1.03
complex | | relative_rmse ~ triangles | -9 -0.1";

fn check_law(tables: &BTreeMap<String, Rows>, law: &str) {
    let [study, filter, what, range] = law.split('|').map(str::trim).collect::<Vec<_>>()[..] else {
        panic!("{law}")
    };
    let mut rows = tables[study].clone();
    for (column, value) in filter.split("; ").filter_map(|one| one.split_once('=')) {
        rows = rows.of(column, value);
    }
    let values = match what.split_whitespace().collect::<Vec<_>>()[..] {
        [y, "~", x] => vec![rows.slope(x, y)],
        ["spread", y] => {
            let mut values = rows.numbers(y);
            values.sort_by(f64::total_cmp);
            vec![values[values.len() - 1] / values[0]]
        }
        _ => rows.0.iter().filter_map(|row| row[what].as_f64()).collect(),
    };
    let range: Vec<f64> = range
        .split(' ')
        .map(|end| end.parse().expect("a number"))
        .collect();
    let holds = |value: &f64| (range[0]..=range[1]).contains(value);
    assert!(
        !values.is_empty() && values.iter().all(holds),
        "{law}: {values:?}"
    );
}

#[test]
fn built_in_studies_keep_their_laws() {
    let sandbox = Sandbox::new();
    let reports = sandbox.succeed("study pages -o out --quick --json").json();
    let reports = reports.as_array().expect("a report of each").iter();
    let table = |report: &Value| {
        (
            report["study"].as_str().expect("a name").into(),
            rows(&sandbox, report),
        )
    };
    let tables: BTreeMap<String, Rows> = reports.map(table).collect();
    assert_eq!(tables.len(), 11);
    for law in LAWS.lines().skip(1) {
        check_law(&tables, law);
    }
    let reached = tables["accuracy"].of("estimator", "auto");
    let targets = reached.numbers("target").into_iter();
    assert!(
        reached
            .numbers("estimated_rmse")
            .into_iter()
            .zip(targets)
            .all(|(error, target)| error <= target)
    );
    let blurred = tables["sigma"].of("kernel", "ellipses, integrated").errors();
    assert!(
        blurred
            .iter()
            .any(|error| 1.2 * error < blurred[blurred.len() - 1]),
        "{blurred:?}"
    );
    let kernels = &tables["kernels"];
    let even = kernels.of("placement", "even").of("kernel", "gaussian 1");
    assert!(
        kernels.0.len() == 42 && even.of("size", "neighbours").errors() < even.of("size", "fixed").errors()
    );
    let hits = &tables["connectivity"];
    let areas = hits.of("estimate", "auto").errors()[0];
    assert!(
        hits.of("estimate", "nearest hits")
            .errors()
            .iter()
            .all(|error| *error > areas),
        "{hits:?}"
    );
    let [fine, bumps, coarse, ..] = tables["pool"].errors()[..] else {
        panic!("three waters")
    };
    assert!(coarse > 2.0 * fine && bumps > fine, "{:?}", tables["pool"]);
}

/// The first map of a folder, and the area of its texels [m²], which are of one size.
fn first_map(sandbox: &Sandbox, folder: &str) -> (String, f64) {
    let manifest = sandbox.manifest(folder);
    let map = &manifest["maps"][0];
    let file = map["file"].as_str().expect("a path");
    (
        format!("{folder}/{file}"),
        map["texel_area_m2"].as_f64().expect("an area"),
    )
}

/// How far the first map of a folder is from the reference.
fn compared(sandbox: &Sandbox, folder: &str) -> f64 {
    let (file, _) = first_map(sandbox, folder);
    let run = sandbox.succeed(&format!("compare {file} {S5} --json"));
    run.json()["relative_rmse"].as_f64().expect("an error")
}

#[test]
fn convergence_measures_what_compare_does() {
    const LINE: &str = "convergence builtin:mirror --map-resolution 32 --quick";
    let sandbox = Sandbox::new();
    let (shipped, _) = study(&sandbox, &format!("{LINE} -o out --densities 1e4,1e5"));
    assert_eq!(shipped.words("estimator"), ["photon", "photon", "splat", "splat"]);
    assert_eq!(shipped.words("reference"), ["analytic S5"; 4]);
    for (column, range) in [
        ("rays", 1.0..1e6),
        ("cpu_s", 1e-9..1e3),
        ("relative_rmse", 1e-9..1.0),
        ("ard", 1e-9..1.0),
        ("peak_ratio", 0.3..3.0),
        ("flux_ratio", 0.9..1.1),
    ] {
        let values = shipped.numbers(column);
        assert!(
            values.iter().all(|value| range.contains(value)),
            "{column}: {values:?}"
        );
    }
    sandbox.succeed("bake builtin:mirror -o maps --estimator splat --density 1e4 --map-resolution 32");
    let expected = compared(&sandbox, "maps");
    let given = format!("--densities 1e4 --estimators splat --reference {S5} --surface floor");
    let (given, _) = study(&sandbox, &format!("{LINE} -o given {given}"));
    for error in [shipped.errors()[2], given.errors()[0]] {
        assert!((error / expected - 1.0).abs() < 1e-6, "{error}, not {expected}");
    }
    // An earlier study is replaced, other files stay.
    sandbox.write("given/notes.txt", "keep me");
    sandbox.succeed(&format!("study {LINE} -o given --densities 1e2"));
    let csv = std::fs::read_to_string(sandbox.path("given/convergence.csv")).expect("a table");
    assert!(csv.lines().count() == 3 && sandbox.path("given/notes.txt").exists());
}

#[test]
fn convergence_without_reference_bakes_one() {
    let line = "convergence builtin:showroom -o out --densities 1e2,1e3 --estimators splat --quick --map-resolution 16";
    let (rows, report) = study(&Sandbox::new(), line);
    assert!(
        rows.words("reference")[0].starts_with("a bake by splat"),
        "{rows:?}"
    );
    assert!(rows.errors()[1] < rows.errors()[0], "{rows:?}");
    let costs = report["costs"]["rows"].as_array().expect("costs");
    assert!(costs.len() == 2 && costs[0][2].as_f64() < Some(0.0), "{costs:?}");
}

#[test]
fn references_know_their_noise() {
    let sandbox = Sandbox::new();
    let run = sandbox.succeed("study reference builtin:mirror -o out --rays 2e5 --map-resolution 32 --json");
    assert_eq!(sandbox.files("out"), ["manifest.json", "maps", "reference.json"]);
    let over = compared(&sandbox, "out") / run.json()["noise"].as_f64().expect("a noise");
    assert!((0.75..1.33).contains(&over), "off by {over} times the noise");
    // A folder of maps as any other.
    sandbox.succeed("render builtin:mirror -o picture.png --maps out --backend cpu --size 32x18");
}

#[test]
fn effects_are_worth_what_maps_say() {
    const QUICK: &str = "--density 1e3 --map-resolution 32 --layers caustic,direct";
    let sandbox = Sandbox::new();
    let (rows, _) = study(
        &sandbox,
        &format!("effects builtin:ball -o out {QUICK} --repeat 2"),
    );
    assert_eq!(
        rows.words("without"),
        ["none", "light_pass", "refraction", "reflection", "direct"]
    );
    let [with, without] = ["auto", "off"].map(|switch| {
        sandbox.succeed(&format!(
            "bake builtin:ball -o {switch} {QUICK} --effects refraction={switch}"
        ));
        let (file, texel_area_m2) = first_map(&sandbox, switch);
        let image = FloatImage::read(&sandbox.path(&file)).expect("a map");
        let values = image.luminance("").expect("R, G, B").values;
        values.iter().sum::<f64>() * texel_area_m2
    });
    let (worth, errors) = (rows.numbers("worth_w"), rows.errors());
    assert!(
        with - without > 1.0 && (worth[2] / (with - without) - 1.0).abs() < 1e-6,
        "{worth:?}"
    );
    assert_eq!((worth[0], errors[0]), (0.0, 0.0), "{rows:?}");
    assert!(errors[1..].iter().all(|rmse| *rmse > 0.0), "{rows:?}");
    for effect in ["refraction", "direct"] {
        let picture = image::open(sandbox.path(&format!("out/difference_{effect}.png"))).expect("a PNG");
        let picture = picture.to_rgb8();
        let warmth = |pixel: &image::Rgb<u8>| i32::from(pixel.0[0]) - i32::from(pixel.0[2]);
        assert!(
            picture.pixels().map(warmth).max() > Some(50),
            "{effect} adds light"
        );
    }
}

#[test]
fn the_whole_spectrum_beats_few_wavelengths() {
    let sandbox = Sandbox::new();
    let line = "spectrum builtin:prism -o out --wavelengths 1,7 --density 1.2e7 --map-resolution 128 --quick";
    let (rows, _) = study(&sandbox, line);
    assert_eq!(
        rows.words("wavelengths"),
        ["1", "7", "1", "7", "continuous", "1", "7", "continuous"]
    );
    assert_eq!(
        rows.of("estimator", "splat").words("sampling")[1..3],
        ["split", "stochastic"]
    );
    let [errors, rays, flux] = ["colour_error", "rays", "flux_ratio"].map(|name| rows.numbers(name));
    assert!(rays[1] > 6.0 * rays[0] && rays[3] < 2.0 * rays[2], "{rays:?}");
    // Of bundles and photons.
    assert!(errors[6] < errors[5] && errors[7] < 0.5 * errors[6], "{errors:?}");
    assert!(
        !flux[5..].iter().any(|ratio| (ratio - 1.0).abs() > 0.05),
        "{flux:?}"
    );
    // Nine strips of one height, four pixels apart: the reference, then row by row.
    let strips = image::open(sandbox.path("out/spectrum.png"))
        .expect("a PNG")
        .to_rgb8();
    let step = (strips.height() + 4) / 9;
    assert_eq!(strips.height(), 9 * step - 4);
    let colourful = |strip: u32| {
        let lines = strips
            .rows()
            .skip((strip * step) as usize)
            .take(step as usize - 4);
        let spread = |pixel: &image::Rgb<u8>| {
            pixel
                .0
                .iter()
                .max()
                .map(|most| most - pixel.0.iter().min().unwrap_or(most))
        };
        lines.flatten().filter_map(spread).max().expect("pixels")
    };
    assert!(colourful(0) > 100 && colourful(8) > 100, "spectra are coloured");
    assert!(colourful(6) < 30, "one wavelength leaves a white line");
}

/// Exit code, arguments, and words of the sentence.
const REFUSED: &str = "
2 | | --list
2 | rainbows -o new | rainbows
2 | rays | --output
2 | convergence | --output
2 | convergence -o new --densities 1e4,1e3 | ascending
2 | convergence -o new --densities 0 | --densities
2 | convergence -o new --densities few | --densities
2 | convergence -o new --repeat 0 | --repeat
2 | convergence -o new --surface floor | --reference
2 | convergence -o new --map-resolution auto | --map-resolution
2 | convergence -o new --estimators guess | guess
2 | reference builtin:ring -o new | --rays
2 | reference builtin:ring -o new --rays 10 | --rays
2 | reference builtin:ring -o new --rays -1 | --rays
2 | reference builtin:ring -o new --rays 1e4 --map-resolution auto | --map-resolution
2 | effects -o new | SCENE
2 | effects builtin:ball | --output
2 | effects builtin:ball -o new --repeat -1 | --repeat
2 | effects builtin:ball -o new --max-time 1s | --max-time
2 | effects builtin:ball -o new --effects indirect=maybe | indirect
2 | effects builtin:ball -o new --effects sparkle=off | sparkle
2 | spectrum -o new --wavelengths 0 | --wavelengths
1 | spectrum builtin:mirror -o new --quick | builtin:spectrum
1 | rays -o photos --quick | photos --force
1 | convergence builtin:mirror -o photos --quick | photos --force
1 | reference builtin:mirror -o photos --rays 1e4 | photos --force
1 | convergence missing.glb -o new --quick | missing.glb
1 | convergence builtin:mirror -o new --reference missing.pfm | missing.pfm
1 | convergence builtin:mirror -o new --densities 1e2 --quick --reference odd.pfm | odd.pfm multiples
1 | convergence builtin:mirror -o new --reference odd.pfm --surface cellar | cellar --surface";

#[test]
fn bad_studies_are_refused_and_write_nothing() {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("photos")).expect("writable");
    sandbox.write("photos/cat.jpg", "a cat");
    sandbox.write("odd.pfm", "Pf\n3 3\n-1.0\nabcdabcdabcdabcdabcdabcdabcdabcdabcd");
    for line in REFUSED.lines().skip(1) {
        let [code, arguments, words] = line.split('|').collect::<Vec<_>>()[..] else {
            panic!("{line}")
        };
        let words: Vec<&str> = words.split_whitespace().collect();
        let run = sandbox.run(&format!("study {arguments}"));
        run.failed_in_one_sentence(code.trim().parse().expect("a code"), &words);
    }
    assert_eq!(sandbox.files("."), ["odd.pfm", "photos"]);
    assert_eq!(sandbox.files("photos"), ["cat.jpg"]);
}

/// A matte ball of 5,120 triangles without coordinates, and a lamp.
fn ball() -> Vec<u8> {
    let mesh = shapes::sphere(dvec3(2.0, 0.0, 0.0), 0.5, 4);
    let mut file = Glb::empty();
    let [positions, normals] = [&mesh.positions, &mesh.normals].map(|vectors| file.push_vectors(vectors));
    let indices = file.push_indices(mesh.triangles.as_flattened());
    let attributes = json!({ "POSITION": positions, "NORMAL": normals });
    let mesh = file.push_mesh(json!({ "attributes": attributes, "indices": indices }));
    file.push_root(json!({ "name": "ball", "mesh": mesh }));
    file.with_light("lamp", json!({ "type": "point", "intensity": 1000.0 }))
        .bytes()
}

const BAKE: &str = "bake ball.glb -o out --layers direct --map-resolution 64 --force";

#[test]
fn coordinates_are_kept_and_never_trusted() {
    let sandbox = Sandbox::new();
    sandbox.write("ball.glb", ball());
    let maps = |options: &str| {
        sandbox.succeed(&format!("{BAKE}{options}"));
        ["0000_ball.exr", "0000_ball.uv"].map(|file| {
            std::fs::read(sandbox.path("out/maps").join(file)).expect("a map with its coordinates")
        })
    };
    let fresh = maps(" --no-cache");
    assert!(sandbox.files(sandbox.cache()).is_empty());
    assert!(maps("") == fresh);
    let kept = sandbox.files(sandbox.cache());
    assert!(!kept.is_empty());
    assert!(maps("") == fresh, "what was kept is what was made");
    for file in &kept {
        let path = sandbox.cache().join(file);
        let bytes = std::fs::read(&path).expect("kept");
        std::fs::write(&path, &bytes[..bytes.len() / 2]).expect("writable");
    }
    assert!(maps("") == fresh, "half a file is none");
    assert_eq!(sandbox.files(sandbox.cache()), kept);
}
