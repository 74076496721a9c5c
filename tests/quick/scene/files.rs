//! Files are read whole within a limit, and written whole or not at all.

use std::io;
use std::path::Path;

use nephroid::files::{read_file, write_atomically};

/// The error as its one sentence.
#[track_caller]
fn sentence<T: std::fmt::Debug>(result: nephroid::error::Result<T>) -> String {
    result.expect_err("has to be refused").to_string()
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("folder can be listed");
    entries
        .map(|entry| {
            entry
                .expect("entry can be read")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect()
}

#[test]
fn what_is_written_is_read_and_the_limit_is_exact() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("a.bin");
    write_atomically(&path, |writer| writer.write_all(&[7; 1000])).expect("can be written");
    assert_eq!(read_file(&path, 1000).expect("fits exactly"), vec![7; 1000]);
    assert!(sentence(read_file(&path, 999)).contains("a.bin: is larger than"));
    write_atomically(&path, |writer| writer.write_all(b"new")).expect("can be replaced");
    assert_eq!(read_file(&path, 1000).expect("can be read"), b"new");
    assert_eq!(names_in(folder.path()), ["a.bin"]);
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("a.bin");
    write_atomically(&path, |writer| writer.write_all(b"old")).expect("can be written");
    let result = write_atomically(&path, |writer| {
        writer.write_all(&[1; 100_000])?;
        Err(io::Error::from(io::ErrorKind::StorageFull))
    });
    let message = sentence(result);
    assert!(
        message.contains("a.bin: does not fit on the disk; free some space"),
        "{message}"
    );
    assert_eq!(read_file(&path, 10).expect("still there"), b"old");
    assert_eq!(names_in(folder.path()), ["a.bin"]);
}

#[test]
fn bad_places_get_a_sentence() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let at = |name: &str| folder.path().join(name);
    write_atomically(&at("file"), |writer| writer.write_all(b"x")).expect("can be written");
    let write = |name: &str| sentence(write_atomically(&at(name), |writer| writer.write_all(b"x")));
    assert!(
        write("none/a").contains("its folder does not exist"),
        "{}",
        write("none/a")
    );
    assert!(
        write("file/a").contains("part of the path is a file"),
        "{}",
        write("file/a")
    );
    assert!(sentence(write_atomically(folder.path(), |_| Ok(()))).contains("is a folder"));
    assert!(sentence(read_file(folder.path(), 10)).contains("is a folder"));
    assert!(sentence(read_file(&at("none"), 10)).contains("there is no such file"));
    assert!(sentence(read_file(&at("file/a"), 10)).contains("part of the path is a file"));
}

#[cfg(unix)]
#[test]
fn devices_are_not_read_and_results_are_as_public_as_other_files() {
    use std::os::unix::fs::PermissionsExt;
    assert!(sentence(read_file(Path::new("/dev/zero"), 10)).contains("is not a regular file"));
    let folder = tempfile::tempdir().expect("temporary folder");
    let mode = |name: &str| {
        let metadata = std::fs::metadata(folder.path().join(name)).expect("is there");
        metadata.permissions().mode() & 0o777
    };
    std::fs::write(folder.path().join("plain"), b"x").expect("can be written");
    write_atomically(&folder.path().join("ours"), |writer| writer.write_all(b"x")).expect("can be written");
    assert_eq!(mode("ours"), mode("plain"));
}
