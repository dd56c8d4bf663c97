//! Tables on disk: kept, read back to the bit, and never trusted when damaged, old or renamed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

use skyloom::optics::Mix;
use skyloom::tables::{Detail, MixTables, TableLibrary};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

fn mix(asymmetry: f64) -> Mix {
    Mix::HenyeyGreenstein { asymmetry, albedo: 0.999 }
}

/// A folder of its own for each test, removed with it.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("skyloom-tables-{}-{name}", std::process::id()));
        Self(path)
    }

    fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<_> = std::fs::read_dir(&self.0).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        files
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Tables through a library that knows nothing yet, and how often it told of progress: 1 when they came from disk.
fn fresh(folder: &Path, mix: &Mix) -> (std::sync::Arc<MixTables>, usize) {
    let told = AtomicUsize::new(0);
    let library = TableLibrary::new(Some(folder.to_owned()));
    let progress = |_| {
        told.fetch_add(1, Ordering::Relaxed);
    };
    let tables = library.get(mix, Some(Detail::Coarse), &progress).unwrap();
    (tables, told.into_inner())
}

#[test]
fn tables_come_back_from_disk_to_the_bit() {
    let folder = Folder::new("again");
    let (made, told) = fresh(&folder.0, &mix(0.8));
    assert!(told > 10, "making tables tells how far it is");
    assert_eq!(folder.files().len(), 2, "the mix's own tables, and radiance of one size");
    let (read, told) = fresh(&folder.0, &mix(0.8));
    assert_eq!(told, 1, "nothing was made");
    assert_eq!(made, read);
    assert_eq!(made.radiance(Detail::Coarse, &|_| ()), read.radiance(Detail::Coarse, &|_| ()));
}

#[test]
fn damaged_old_cut_or_foreign_files_are_made_again() {
    let folder = Folder::new("damaged");
    let (made, _) = fresh(&folder.0, &mix(0.7));
    let good: Vec<(PathBuf, Vec<u8>)> =
        folder.files().into_iter().map(|path| (path.clone(), std::fs::read(path).unwrap())).collect();
    for (path, bytes) in &good {
        let flipped = |at: usize| {
            let mut bytes = bytes.clone();
            bytes[at] ^= 1;
            bytes
        };
        let damages = [
            Vec::new(),
            b"not a table".to_vec(),
            bytes[..bytes.len() / 2].to_vec(),
            bytes[..bytes.len() - 1].to_vec(),
            flipped(3),
            flipped(20),
            flipped(60),
            flipped(bytes.len() - 1),
            [bytes.as_slice(), b"more"].concat(),
        ];
        for damaged in damages {
            std::fs::write(path, &damaged).unwrap();
            let (again, told) = fresh(&folder.0, &mix(0.7));
            assert!(told > 1, "a damaged file was taken for good");
            assert_eq!(made, again);
            assert_eq!(&std::fs::read(path).unwrap(), bytes, "the file was not mended");
        }
    }
    // The tables of another mix under this one's name.
    let (_, _) = fresh(&folder.0, &mix(0.6));
    let key = mix(0.6).key();
    for path in folder.files() {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if let Some(rest) = name.strip_prefix(&key) {
            std::fs::copy(&path, folder.0.join(format!("{}{rest}", mix(0.7).key()))).unwrap();
        }
    }
    assert_eq!(fresh(&folder.0, &mix(0.7)).0, made);
}

#[test]
fn a_folder_that_cannot_be_written_is_no_failure() {
    let file = std::env::temp_dir().join(format!("skyloom-no-folder-{}", std::process::id()));
    std::fs::write(&file, b"").unwrap();
    let (tables, _) = fresh(&file.join("below"), &mix(0.5));
    assert!((tables.channels[0].asymmetry - 0.5).abs() < 1e-6);
    std::fs::remove_file(file).unwrap();
}

/// Tables that cannot be made, by a mix that no scene can name, are not being made for ever.
#[test]
fn a_failure_ends_the_making() {
    let library = TableLibrary::new(None);
    let wrong = Mix::HenyeyGreenstein { asymmetry: 2.0, albedo: 1.0 };
    for _ in 0..2 {
        assert!(library.get(&wrong, Some(Detail::Coarse), &|_| ()).is_err());
        assert!(!library.ready(&wrong) && library.progress(&wrong).is_none());
    }
    let cut_off = std::panic::AssertUnwindSafe(|| library.get(&mix(0.2), None, &|_| panic!("cut off")));
    assert!(std::panic::catch_unwind(cut_off).is_err());
    assert!(!library.ready(&mix(0.2)) && library.progress(&mix(0.2)).is_none());
    assert!(library.get(&mix(0.2), None, &|_| ()).is_ok());
}

#[test]
fn many_callers_make_a_mix_once() {
    let library = TableLibrary::new(None);
    let starts = AtomicUsize::new(0);
    let progress = |part: f64| {
        if part == 0.0 {
            starts.fetch_add(1, Ordering::Relaxed);
        }
    };
    let tables: Vec<_> = std::thread::scope(|scope| {
        let callers: Vec<_> =
            (0..8).map(|_| scope.spawn(|| library.get(&mix(0.4), None, &progress).unwrap())).collect();
        callers.into_iter().map(|caller| caller.join().unwrap()).collect()
    });
    assert_eq!(starts.into_inner(), 1);
    assert!(tables.iter().all(|other| std::sync::Arc::ptr_eq(other, &tables[0])));
    assert!(library.ready(&mix(0.4)) && library.progress(&mix(0.4)).is_none());
    assert!(!library.ready(&mix(0.3)));
}
