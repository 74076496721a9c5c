//! Studies that come as pages: each runs in its quick form, writes what it names, and its figures keep their laws.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use crate::program::Sandbox;

/// Rows by column.
type Rows = Vec<BTreeMap<String, String>>;

/// Runs a study by itself, checks its files, and reads its table back.
fn study(name: &str) -> Rows {
    let sandbox = Sandbox::new();
    let run = sandbox.succeed(&format!("study {name} -o out --quick --json"));
    written(name, &sandbox, "out", &run.json())
}

/// The same of a study among all pages, which are made once.
fn page(name: &str) -> Rows {
    static ALL: OnceLock<(Sandbox, serde_json::Value)> = OnceLock::new();
    let (sandbox, reports) = ALL.get_or_init(|| {
        let sandbox = Sandbox::new();
        let run = sandbox.succeed("study pages -o out --quick --json");
        (sandbox, run.json())
    });
    let reports = reports.as_array().expect("a report of each");
    let report = reports.iter().find(|report| report["study"] == name);
    written(
        name,
        sandbox,
        &format!("out/{name}"),
        report.expect("it is among them"),
    )
}

fn written(name: &str, sandbox: &Sandbox, folder: &str, report: &serde_json::Value) -> Rows {
    let told: Vec<&str> = report["files"]
        .as_array()
        .expect("files")
        .iter()
        .filter_map(|file| file.as_str())
        .collect();
    let mut sorted: Vec<String> = told.iter().map(|file| (*file).to_string()).collect();
    sorted.sort();
    assert_eq!(sandbox.files(folder), sorted, "{name} names what it writes");
    let markdown = std::fs::read_to_string(sandbox.path(&format!("{folder}/{name}.md"))).expect("a page");
    for word in ["# ", "## What it says", "## Figures", "cores", "threads"] {
        assert!(markdown.contains(word), "{name} lacks {word}: {markdown}");
    }
    assert!(!markdown.contains("NaN"), "{markdown}");
    for file in told
        .iter()
        .filter(|file| file.ends_with("svg") || file.ends_with("png"))
    {
        assert!(
            markdown.contains(&format!("({file})")),
            "{name} does not show {file}"
        );
    }
    for file in told.iter().filter(|file| file.ends_with("png")) {
        let picture = image::open(sandbox.path(&format!("{folder}/{file}")))
            .expect("a picture")
            .to_luma8();
        let (least, most) = (picture.iter().min(), picture.iter().max());
        assert_ne!(least, most, "{file} of {name} shows nothing");
    }
    let mut reader = csv::Reader::from_path(sandbox.path(&format!("{folder}/{name}.csv"))).expect("a table");
    let rows: Rows = reader.deserialize().map(|row| row.expect("a row")).collect();
    assert!(!rows.is_empty(), "{name}");
    rows
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    let text = &row[column];
    text.parse().unwrap_or_else(|_| panic!("{column} is {text:?}"))
}

fn select<'r>(rows: &'r Rows, column: &str, value: &str) -> Vec<&'r BTreeMap<String, String>> {
    rows.iter().filter(|row| row[column] == value).collect()
}

/// d ln(y) / d ln(x) between the first and the last row.
fn slope(rows: &[&BTreeMap<String, String>], x: &str, y: &str) -> f64 {
    let (first, last) = (rows[0], rows[rows.len() - 1]);
    (number(last, y) / number(first, y)).ln() / (number(last, x) / number(first, x)).ln()
}

#[test]
fn accuracy_meets_its_targets_and_tells_what_was_predicted() {
    let rows = study("accuracy");
    for scene in ["mirror", "pool"] {
        let of: Rows = select(&rows, "scene", scene).into_iter().cloned().collect();
        let wavefront = select(&of, "estimator", "wavefront");
        for row in &wavefront {
            assert!(number(row, "estimated_rmse") <= number(row, "target"), "{row:?}");
            assert!(
                number(row, "memory_mb") > 0.0 && number(row, "cpu_s") > 0.0,
                "{row:?}"
            );
        }
        assert!(
            slope(&wavefront, "target", "rays") < 0.0,
            "less error takes more rays"
        );
        let predicted = wavefront.iter().filter(|row| !row["rays_ratio"].is_empty());
        for row in predicted.clone() {
            let ratio = number(row, "rays_ratio");
            assert!((0.3..3.0).contains(&ratio), "{row:?}");
        }
        assert!(predicted.count() > 0, "{scene}");
        // Splats: first order at best, the square root of random rays at least.
        let splats = select(&of, "estimator", "splat");
        let power = slope(&splats, "rays", "true_rmse");
        assert!((-1.5..-0.1).contains(&power), "{scene}: {power}");
    }
}

#[test]
fn table_1_has_the_papers_rays_per_density() {
    let rows = page("table1");
    let splats = select(&rows, "estimator", "splat, as the paper");
    assert!((slope(&splats, "density_per_sr", "rays") - 1.0).abs() < 0.05);
    assert!((slope(&splats, "density_per_sr", "paper_rays") - 1.0).abs() < 0.01);
    assert!(slope(&splats, "rays", "relative_rmse") < -0.1);
}

#[test]
fn errors_fall_with_rays() {
    let rows = page("rays");
    for (estimator, most) in [
        ("splat, as the paper", -0.15),
        ("splat", -0.15),
        ("wavefront", -0.1),
    ] {
        let power = slope(&select(&rows, "estimator", estimator), "rays", "relative_rmse");
        assert!((-2.0..most).contains(&power), "{estimator}: {power}");
    }
}

#[test]
fn too_much_blur_is_an_error() {
    let rows = page("sigma");
    let ours = select(&rows, "kernel", "ellipses, integrated");
    let errors: Vec<f64> = ours.iter().map(|row| number(row, "relative_rmse")).collect();
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(errors[errors.len() - 1] > 1.2 * least, "{errors:?}");
}

#[test]
fn finer_maps_show_more_of_the_error() {
    let rows = page("resolution");
    let splats = select(&rows, "estimator", "splat");
    assert!(slope(&splats, "side_texels", "relative_rmse") > 0.0);
    assert_eq!(
        splats[0]["rays"], splats[1]["rays"],
        "rays do not depend on texels"
    );
}

#[test]
fn kernels_scaled_by_neighbours_beat_fixed_ones() {
    let rows = page("kernels");
    assert_eq!(rows.len(), 42);
    let even: Rows = select(&rows, "placement", "even").into_iter().cloned().collect();
    let of = |size: &str| {
        let of = select(&even, "size", size);
        let gaussian = of
            .iter()
            .find(|row| row["kernel"] == "gaussian 1")
            .expect("a row");
        number(gaussian, "relative_rmse")
    };
    assert!(of("neighbours") < of("fixed"));
    for row in &rows {
        assert!(number(row, "paper_rms") > 0.0, "{row:?}");
    }
}

#[test]
fn neighbouring_rays_beat_nearest_hits() {
    let rows = page("connectivity");
    let error = |estimate: &str| number(select(&rows, "estimate", estimate)[0], "relative_rmse");
    let best = ["4 nearest hits", "16 nearest hits", "64 nearest hits"].map(error);
    let wavefront = error("areas between rays, wavefront");
    assert!(
        best.iter().all(|error| *error > wavefront),
        "{best:?} and {wavefront}"
    );
}

#[test]
fn neither_item_buffer_loses_flux() {
    for row in &page("item-buffer") {
        assert!((number(row, "flux_ratio") - 1.0).abs() < 0.03, "{row:?}");
    }
}

#[test]
fn coarse_water_is_a_larger_error_than_fine_water() {
    let rows = page("pool");
    let error = |row: usize| number(&rows[row], "relative_rmse");
    assert!(error(2) > 2.0 * error(0), "{rows:?}");
    assert!(error(1) > error(0), "bumps are not waves");
}

#[test]
fn more_triangles_are_nearer_to_the_shape() {
    let rows = page("complex");
    let all: Vec<_> = rows.iter().collect();
    assert!(slope(&all, "triangles", "relative_rmse") < -0.1, "{rows:?}");
}

#[test]
fn segments_per_ray_do_not_grow_with_rays_or_triangles() {
    let rows = page("scaling");
    for what in ["rays", "triangles"] {
        let of = select(&rows, "what", what);
        let segments: Vec<f64> = of.iter().map(|row| number(row, "segments_per_ray")).collect();
        let (least, most) = segments
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(a, b), s| (a.min(*s), b.max(*s)));
        assert!(most < 1.5 * least, "{what}: {segments:?}");
    }
    let of_rays = select(&rows, "what", "rays");
    let memory = slope(&of_rays, "rays", "memory_mb");
    assert!(memory < 0.1, "memory grows with rays to the {memory}");
    let threads: Vec<u64> = select(&rows, "what", "threads")
        .iter()
        .map(|row| number(row, "rays") as u64)
        .collect();
    assert_eq!(threads[0], threads[1], "threads change no ray");
}
