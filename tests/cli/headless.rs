//! Without a display: files instead of a window.

use crate::program::Sandbox;

const QUICK: &str = "--density 1e3 --map-resolution 32 --size 64x48";

#[test]
fn no_display_writes_maps_and_a_picture() {
    let sandbox = Sandbox::new();
    for line in [
        format!("builtin:slab {QUICK}"),
        format!("view builtin:slab {QUICK}"),
    ] {
        let run = sandbox.succeed(&line);
        assert_eq!(run.stdout, "./nephroid-out/\n");
        let says_so = run
            .stderr
            .lines()
            .filter(|line| line.contains("no display"))
            .count();
        assert_eq!(says_so, 1, "{}", run.stderr);
        assert_eq!(
            sandbox.files("nephroid-out"),
            ["manifest.json", "maps", "picture.png"]
        );
        assert_eq!(sandbox.manifest("nephroid-out")["partial"], false);
        let picture = image::open(sandbox.path("nephroid-out/picture.png")).expect("a PNG");
        assert_eq!((picture.width(), picture.height()), (64, 48));
        let pixels = picture.to_rgb8();
        let brightest = pixels.pixels().map(|pixel| pixel.0[1]).max();
        assert!(brightest > Some(64), "{brightest:?}");
    }
}

#[test]
fn chains_are_left_out_of_the_picture_where_they_are_switched_off() {
    let sandbox = Sandbox::new();
    let black_pixels = |switch: &str| {
        sandbox.succeed(&format!(
            "view builtin:mirror {QUICK} --exposure 0 --effects chains={switch}"
        ));
        let picture = image::open(sandbox.path("nephroid-out/picture.png")).expect("a PNG");
        let pixels = picture.to_rgb8();
        pixels.pixels().filter(|pixel| pixel.0 == [0; 3]).count()
    };
    let [auto, off] = ["auto", "off"].map(black_pixels);
    assert!(
        off > auto + 20,
        "{off} black pixels without chains, {auto} with them"
    );
}

#[test]
fn a_display_that_is_not_there_counts_as_none() {
    let sandbox = Sandbox::new();
    let arguments: Vec<&str> = "builtin:slab".split(' ').chain(QUICK.split(' ')).collect();
    let output = sandbox
        .command(&arguments)
        .env("DISPLAY", ":987")
        .output()
        .expect("the program starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(sandbox.path("nephroid-out/picture.png").exists());
}
