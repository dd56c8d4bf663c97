//! What takes long is made once for all who ask, kept on disk, read back to the bit, and never trusted when it is damaged,
//! old or renamed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

use skyloom::optics::{Mix, OpticsError};
use skyloom::plan::Plan;
use skyloom::scene_air::air_mix;
use skyloom::store;
use skyloom::tables::{AirMix, Artefact, Detail, MixTables, TableError, TableLibrary};
use skyloom::{Images, Request, Scene};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Barrier};

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
        let folder = self.0.join("tables");
        let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        files
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn library(folder: &Path) -> TableLibrary {
    TableLibrary::new(Some(Arc::new(store::Folder::new(folder))))
}

/// Tables through a library that knows nothing yet, and how often it told of progress: never when they came from disk.
fn fresh(folder: &Path, mix: &Mix) -> (Arc<MixTables>, usize) {
    let told = AtomicUsize::new(0);
    let library = library(folder);
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
    assert_eq!(told, 0, "nothing was made");
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
            assert!(told > 0, "a damaged file was taken for good");
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
            std::fs::copy(&path, path.with_file_name(format!("{}{rest}", mix(0.7).key()))).unwrap();
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

/// How often something is made is counted below; here that a mix is such a thing.
#[test]
fn many_callers_share_a_mix() {
    let library = TableLibrary::new(None);
    let tables: Vec<_> = std::thread::scope(|scope| {
        let callers: Vec<_> = (0..8).map(|_| scope.spawn(|| library.get(&mix(0.4), None, &|_| ()).unwrap())).collect();
        callers.into_iter().map(|caller| caller.join().unwrap()).collect()
    });
    assert!(tables.iter().all(|other| Arc::ptr_eq(other, &tables[0])));
    assert!(library.ready(&mix(0.4)) && library.progress(&mix(0.4)).is_none());
    assert!(!library.ready(&mix(0.3)));
}

/// An artefact that is made as a test says: the sum of some numbers.
struct Sum<'a> {
    name: &'a str,
    numbers: &'a [u8],
    made: &'a AtomicUsize,
    /// Met while it is made: once when it has begun, once before it ends.
    meet: Option<&'a Barrier>,
    act: Act,
}

#[derive(Clone, Copy, PartialEq)]
enum Act {
    Make,
    Fail,
    Panic,
}

impl Artefact for Sum<'_> {
    type Value = u64;

    fn key(&self) -> String {
        format!("sum-{}", self.name)
    }

    fn describe(&self) -> String {
        format!("the sum {}", self.name)
    }

    fn build(&self, progress: &(dyn Fn(f64) + Sync)) -> Result<u64, TableError> {
        self.made.fetch_add(1, Ordering::Relaxed);
        progress(0.5);
        if let Some(meet) = self.meet {
            meet.wait();
            meet.wait();
        }
        match self.act {
            Act::Make => Ok(self.numbers.iter().map(|number| u64::from(*number)).sum()),
            Act::Fail => Err(TableError::Optics { mix: self.describe(), reason: OpticsError::Dark }),
            Act::Panic => panic!("a test"),
        }
    }

    fn to_parts(&self, value: &u64) -> Vec<Vec<u8>> {
        vec![self.numbers.to_vec(), value.to_le_bytes().to_vec(), Vec::new()]
    }

    fn read_parts(&self, parts: &[&[u8]]) -> Option<u64> {
        let [numbers, value, []] = parts else { return None };
        (*numbers == self.numbers).then_some(u64::from_le_bytes((*value).try_into().ok()?))
    }

    fn bytes(&self, _: &u64) -> usize {
        8
    }
}

/// Asks for a sum from one thread, and from others while it is being made.
fn together(library: &TableLibrary, act: Act, made: &AtomicUsize) -> Vec<Result<u64, Option<TableError>>> {
    let (meet, begun) = (Barrier::new(2), Barrier::new(4));
    let sum = |act, meet| Sum { name: "of-many", numbers: &[1, 2, 3], made, meet, act };
    std::thread::scope(|scope| {
        let ask = |sum: Sum<'_>| library.artefact(&sum, &|_| ()).map(|value| *value);
        let (first, second) = (sum(act, Some(&meet)), [(); 3].map(|()| sum(act, None)));
        let mut callers = vec![scope.spawn(move || ask(first))];
        meet.wait();
        assert_eq!(library.progress_of::<u64>("sum-of-many"), Some(0.5));
        assert!(!library.has::<u64>("sum-of-many"));
        let begun = &begun;
        callers.extend(second.map(|sum| {
            scope.spawn(move || {
                begun.wait();
                ask(sum)
            })
        }));
        begun.wait();
        // Long enough for them to wait; were they late, they would make it themselves and be counted.
        std::thread::sleep(std::time::Duration::from_millis(200));
        meet.wait();
        callers.into_iter().map(|caller| caller.join().map_or(Err(None), |result| result.map_err(Some))).collect()
    })
}

#[test]
fn any_artefact_is_made_once_and_kept() {
    let folder = Folder::new("artefact");
    let made = AtomicUsize::new(0);
    let own = library(&folder.0);
    assert_eq!(together(&own, Act::Make, &made), vec![Ok(6); 4]);
    assert_eq!(made.load(Ordering::Relaxed), 1);
    assert!(own.has::<u64>("sum-of-many") && own.progress_of::<u64>("sum-of-many").is_none());
    assert!(!own.has::<u32>("sum-of-many"), "another type of the same key is another artefact");
    // From disk, unless it is that of other numbers under the same key.
    let ask = |numbers| {
        let sum = Sum { name: "of-many", numbers, made: &made, meet: None, act: Act::Make };
        *library(&folder.0).artefact(&sum, &|_| ()).unwrap()
    };
    assert_eq!((ask(&[1, 2, 3]), made.load(Ordering::Relaxed)), (6, 1));
    assert_eq!((ask(&[1, 2, 4]), made.load(Ordering::Relaxed)), (7, 2));
}

#[test]
fn a_making_that_fails_leaves_nothing_behind_and_is_tried_again() {
    for act in [Act::Fail, Act::Panic] {
        let made = AtomicUsize::new(0);
        let library = TableLibrary::new(None);
        let outcomes = together(&library, act, &made);
        assert_eq!(outcomes[0] == Err(None), act == Act::Panic, "the panic is its maker's");
        for outcome in &outcomes[1..] {
            let Err(Some(error)) = outcome else { panic!("{outcome:?}") };
            assert_eq!(matches!(error, TableError::Abandoned(_)), act == Act::Panic, "{error}");
            assert!(error.to_string().contains("the sum of-many"), "{error}");
        }
        assert_eq!(made.load(Ordering::Relaxed), 1);
        assert_eq!(library.progress_of::<u64>("sum-of-many"), None);
        assert!(!library.has::<u64>("sum-of-many"));
        assert_eq!(together(&library, Act::Make, &made), vec![Ok(6); 4]);
    }
}

#[test]
fn a_mix_that_the_optics_refuse_leaves_no_progress_behind() {
    let library = TableLibrary::new(None);
    let impossible = Mix::Gamma { effective_radius_um: -1.0, broadness: 2.0, refractive_index: None };
    for _ in 0..2 {
        assert!(matches!(library.get(&impossible, Some(Detail::Coarse), &|_| ()), Err(TableError::Optics { .. })));
        assert!(library.progress(&impossible).is_none() && !library.ready(&impossible));
    }
}

#[test]
fn radiance_tables_are_made_once_for_a_mix() {
    let library = TableLibrary::new(None);
    let told = AtomicUsize::new(0);
    let progress = |_| {
        told.fetch_add(1, Ordering::Relaxed);
    };
    let first = library.get(&mix(0.2), Some(Detail::Coarse), &progress).unwrap();
    let count = told.load(Ordering::Relaxed);
    let second = library.get(&mix(0.2), Some(Detail::Coarse), &progress).unwrap();
    assert_eq!(told.into_inner(), count);
    assert!(Arc::ptr_eq(&first, &second));
    assert!(Arc::ptr_eq(&first.radiance(Detail::Coarse, &|_| ()), &second.radiance(Detail::Coarse, &|_| ())));
}

/// The air of a scene for a coarse request, which is made fastest.
fn air(atmosphere: &str) -> AirMix {
    let scene = Scene::from_json(format!(r#"{{"atmosphere": {atmosphere}}}"#).as_bytes()).unwrap();
    let coarse = [("tolerance".to_owned(), "0.1".to_owned())];
    let request = Request::parse("sky", "f32", &coarse).unwrap();
    air_mix(&scene, &Images::new(), &Plan::new(&request, &scene), &TableLibrary::new(None), &|_| ()).unwrap().unwrap()
}

/// Also of numbers that written out are longer than the name of a file.
#[test]
fn air_comes_back_from_disk_to_the_bit() {
    for atmosphere in ["{}", r#"{"aerosol": {"optical_depth": 1e-300, "albedo": 1e-200}, "polarisation": false}"#] {
        let folder = Folder::new(&format!("air-{}", atmosphere.len()));
        let mix = air(atmosphere);
        let fresh = || {
            let told = AtomicUsize::new(0);
            let progress = |_| {
                told.fetch_add(1, Ordering::Relaxed);
            };
            let tables = library(&folder.0).air(&mix, &progress).unwrap();
            (tables.waves.each_ref().map(|wave| wave.to_numbers()), told.into_inner())
        };
        let (made, told) = fresh();
        assert!(told > 4, "making them tells how far it is");
        assert_eq!(folder.files().len(), 1);
        let (read, told) = fresh();
        assert!(told == 0 && read == made, "{atmosphere}: made again, or other numbers");
    }
    assert_ne!(air("{}").key(), air(r#"{"ozone_du": 301}"#).key());
}
