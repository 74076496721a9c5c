//! Files are read whole within a limit, and written whole or not at all.

use std::io;
use std::path::Path;

use nephroid::error::Result;
use nephroid::files::{read_file, write_atomically};

use crate::prelude::*;
use support::program::names;

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically(path, |writer| writer.write_all(bytes))
}

#[test]
fn files_are_written_whole_or_not_at_all() {
    let folder = folder();
    let path = folder.path().join("a.bin");
    write(&path, &[7; 1000]).expect("can be written");
    assert_eq!(read_file(&path, 1000).expect("fits exactly"), vec![7; 1000]);
    says(
        read_file(&path, 999).expect_err("too large"),
        "a.bin: is larger than",
    );
    write(&path, b"old").expect("can be replaced");
    let failed = write_atomically(&path, |writer| {
        writer.write_all(&[1; 100_000])?;
        Err(io::Error::from(io::ErrorKind::StorageFull))
    });
    says(
        failed.expect_err("no room"),
        "a.bin: does not fit on the disk; free some space",
    );
    assert_eq!(read_file(&path, 1000).expect("still there"), b"old");
    assert_eq!(names(folder.path()), ["a.bin"]);
}

#[test]
fn bad_places_get_a_sentence() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    write(&at("file"), b"x").expect("can be written");
    for (name, words) in rows(
        "none/a => its folder does not exist
         file/a => part of the path is a file
         . => is a folder",
    ) {
        says(write(&at(name), b"x").expect_err(name), words);
    }
    for (name, words) in rows(
        ". => is a folder
         none => there is no such file
         file/a => part of the path is a file",
    ) {
        says(read_file(&at(name), 10).expect_err(name), words);
    }
}

#[cfg(unix)]
#[test]
fn devices_are_not_read_and_results_are_public() {
    use std::os::unix::fs::PermissionsExt;
    says(
        read_file(Path::new("/dev/zero"), 10).expect_err("a device"),
        "is not a regular file",
    );
    let folder = folder();
    let mode = |name: &str| {
        let metadata = std::fs::metadata(folder.path().join(name)).expect("is there");
        metadata.permissions().mode() & 0o777
    };
    std::fs::write(folder.path().join("plain"), b"x").expect("can be written");
    write(&folder.path().join("ours"), b"x").expect("can be written");
    assert_eq!(mode("ours"), mode("plain"), "as other files");
}
