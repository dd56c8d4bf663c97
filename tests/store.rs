//! The store in a folder: whole blobs or none, whoever writes, and nothing of others touched.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

use skyloom::store::{Folder, Store as _, StoreError, Upkeep as _, is_leftover, write_atomically};
use std::io::Read as _;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

/// A place of its own for each test, removed with it.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("skyloom-store-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn names(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.join(folder)).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn blobs_are_put_got_listed_and_deleted() {
    let place = Place::new("all");
    let store = Folder::new(place.0.join("not/yet"));
    assert_eq!(store.get("a/b").unwrap(), None);
    assert!(!store.exists("a/b").unwrap() && !store.delete("a/b").unwrap());
    assert_eq!(store.list("a").unwrap(), []);
    for bytes in [&b"one"[..], b"", b"another one"] {
        store.put("a/b", bytes).unwrap();
        assert_eq!(store.get("a/b").unwrap().unwrap(), bytes);
        let listed: Vec<_> = store.list("a").unwrap().into_iter().map(|entry| (entry.name, entry.bytes)).collect();
        assert_eq!(listed, [("b".to_owned(), bytes.len() as u64)]);
    }
    assert!(store.exists("a/b").unwrap() && store.delete("a/b").unwrap() && !store.exists("a/b").unwrap());
    let keys = ["a/b", "a/c", "d/e", "f/g"].map(str::to_owned);
    keys[..3].iter().for_each(|key| store.put(key, b"x").unwrap());
    store.put("a/d", b"x").unwrap();
    store.delete_all(&keys).unwrap();
    assert!(keys.iter().all(|key| !store.exists(key).unwrap()) && store.exists("a/d").unwrap());
    assert!(matches!(store.delete_all(&["a/D".to_owned()]), Err(StoreError::Key(_))));
    assert!(matches!(store.put("../b", b"x"), Err(StoreError::Key(_))));
    assert!(matches!(store.get("a/B"), Err(StoreError::Key(_))));
}

#[test]
fn blobs_are_written_and_read_piece_by_piece_and_none_of_another_length_is_kept() {
    let place = Place::new("pieces");
    let store = Folder::new(&place.0);
    let bytes: Vec<u8> = (0..300_000_u32).map(|place| (place * 7 + place / 251) as u8).collect();
    assert!(store.open("a/b").unwrap().is_none());
    store.put_from("a/b", 300_000, &mut bytes.as_slice()).unwrap();
    let mut blob = store.open("a/b").unwrap().unwrap();
    // What is being read stays, whatever becomes of the key.
    store.put("a/b", b"another").unwrap();
    let mut read = Vec::new();
    blob.bytes.read_to_end(&mut read).unwrap();
    assert!((blob.length, read) == (300_000, bytes.clone()));
    for length in [299_999, 300_001] {
        assert!(store.put_from("a/b", length, &mut bytes.as_slice()).is_err());
    }
    assert_eq!((store.get("a/b").unwrap().unwrap(), place.names("a")), (b"another".to_vec(), vec!["b".to_owned()]));
}

#[test]
fn many_writers_of_one_key_leave_one_whole_blob_and_nothing_else() {
    let place = Place::new("writers");
    let store = Folder::new(&place.0);
    let blob = |writer: u8| vec![writer; 100_000 + usize::from(writer)];
    store.put("a/b", &blob(0)).unwrap();
    std::thread::scope(|scope| {
        let writers: Vec<_> = (1..=4)
            .map(|writer| {
                let store = store.clone();
                scope.spawn(move || (0..10).for_each(|_| store.put("a/b", &blob(writer)).unwrap()))
            })
            .collect();
        while !writers.iter().all(|writer| writer.is_finished()) {
            let bytes = store.get("a/b").unwrap().unwrap();
            assert_eq!(bytes, blob(bytes[0]), "half a blob was seen");
        }
    });
    assert_eq!(place.names("a"), ["b"]);
}

#[test]
fn what_killed_writers_left_is_removed_when_it_is_old_and_nothing_else_is() {
    let place = Place::new("sweep");
    let store = Folder::new(&place.0);
    store.prepare(&["a", "b"]).unwrap();
    let old = SystemTime::now() - Duration::from_secs(7200);
    for (name, modified) in [
        (".b.1-2.skyloom-part", old),
        (".c.1-2.skyloom-part", SystemTime::now()),
        (".d.1.2.tmp", old),
        ("e.skyloom-part", old),
        ("NOTES", old),
        ("f", old),
    ] {
        let file = std::fs::File::create(place.0.join("a").join(name)).unwrap();
        file.set_modified(modified).unwrap();
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("loop", place.0.join("a/loop")).unwrap();
        let folder = place.0.join("a/.g.skyloom-part");
        std::fs::create_dir(&folder).unwrap();
        std::fs::File::open(folder).unwrap().set_modified(old).unwrap();
    }
    store.prepare(&["a", "b"]).unwrap();
    let left: Vec<_> =
        place.names("a").into_iter().filter(|name| name != "loop" && name != ".g.skyloom-part").collect();
    assert_eq!(left, [".c.1-2.skyloom-part", ".d.1.2.tmp", "NOTES", "e.skyloom-part", "f"]);
    let mut listed: Vec<_> = store.list("a").unwrap().into_iter().map(|entry| entry.name).collect();
    listed.sort();
    assert_eq!(listed, ["e.skyloom-part", "f"]);
}

#[test]
fn what_is_no_file_is_no_blob() {
    let place = Place::new("folders");
    let store = Folder::new(&place.0);
    std::fs::create_dir_all(place.0.join("a/b/own")).unwrap();
    assert!(!store.exists("a/b").unwrap() && !store.delete("a/b").unwrap());
    assert_eq!((store.get("a/b").unwrap(), store.list("a").unwrap()), (None, Vec::new()));
    store.put("a/b", b"x").unwrap();
    assert_eq!(store.get("a/b").unwrap().unwrap(), b"x");
    let aside = place.names("a").into_iter().find(|name| name.ends_with(".set-aside")).unwrap();
    assert!(place.0.join("a").join(aside).join("own").is_dir(), "what stood there is kept");
    // A folder of blobs that is a file is no empty folder.
    std::fs::write(place.0.join("f"), b"").unwrap();
    let error = store.put("f/b", b"x").unwrap_err();
    assert!(matches!(error, StoreError::Io { .. }) && error.to_string().contains("f/b"), "{error}");
}

#[cfg(unix)]
#[test]
fn a_link_is_read_through_and_replaced_not_followed() {
    let place = Place::new("links");
    let store = Folder::new(&place.0);
    std::fs::create_dir(place.0.join("a")).unwrap();
    std::fs::write(place.0.join("elsewhere"), b"own").unwrap();
    std::os::unix::fs::symlink(place.0.join("elsewhere"), place.0.join("a/b")).unwrap();
    assert_eq!(store.get("a/b").unwrap().unwrap(), b"own");
    assert_eq!(store.list("a").unwrap()[0].bytes, 3);
    store.put("a/b", b"new").unwrap();
    assert_eq!(std::fs::read(place.0.join("elsewhere")).unwrap(), b"own");
    std::fs::remove_file(place.0.join("a/b")).unwrap();
    std::os::unix::fs::symlink(place.0.join("nowhere"), place.0.join("a/b")).unwrap();
    assert!(!store.exists("a/b").unwrap() && store.list("a").unwrap().is_empty());
}

#[test]
fn a_file_of_the_longest_name_is_written() {
    let place = Place::new("long");
    let path = place.0.join(format!("{}.exr", "ä".repeat(120)));
    write_atomically(&path, b"x").unwrap();
    assert_eq!(std::fs::read(path).unwrap(), b"x");
}

#[test]
fn of_many_who_create_a_key_one_succeeds_and_its_bytes_stay() {
    let place = Place::new("create");
    let store = Folder::new(&place.0);
    for round in 0..20 {
        let key = format!("a/{round}");
        let created: Vec<bool> = std::thread::scope(|scope| {
            let makers: Vec<_> = (0..4_u8)
                .map(|maker| {
                    let (store, key) = (store.clone(), key.clone());
                    scope.spawn(move || store.create(&key, &[maker; 5000]).unwrap())
                })
                .collect();
            makers.into_iter().map(|maker| maker.join().unwrap()).collect()
        });
        let winner = u8::try_from(created.iter().position(|created| *created).unwrap()).unwrap();
        assert_eq!(created.iter().filter(|created| **created).count(), 1);
        assert_eq!(store.get(&key).unwrap().unwrap(), [winner; 5000]);
        assert!(!store.create(&key, b"late").unwrap());
    }
    assert_eq!(place.names("a").len(), 20, "nothing is left beside them");
}

#[test]
fn use_is_noted_and_makes_nothing() {
    let place = Place::new("used");
    let store = Folder::new(&place.0);
    store.put("a/b", b"x").unwrap();
    let day = Duration::from_secs(86_400);
    let file = || std::fs::File::options().write(true).open(place.0.join("a/b")).unwrap();
    file().set_modified(SystemTime::now() - 9 * day).unwrap();
    assert!(store.list("a").unwrap()[0].age(SystemTime::now()) > 8 * day);
    store.used("a/b");
    store.used("a/c");
    store.used("../c");
    let listed = store.list("a").unwrap();
    assert!(listed.len() == 1 && listed[0].age(SystemTime::now()) < day);
    // Used tomorrow, by a clock that was set back since.
    file().set_modified(SystemTime::now() + day).unwrap();
    assert_eq!(store.list("a").unwrap()[0].age(SystemTime::now()), Duration::ZERO);
}

#[test]
fn a_survey_sees_everything_and_what_is_set_aside_is_kept() {
    let place = Place::new("survey");
    let store = Folder::new(&place.0);
    for key in ["a/b", "c", "d/e/f"] {
        store.put(key, key.as_bytes()).unwrap();
    }
    for other in ["a/.x.1-2.skyloom-part", "a/Thumbs.db", "d/e/F"] {
        std::fs::write(place.0.join(other), b"own").unwrap();
    }
    #[cfg(unix)]
    std::os::unix::fs::symlink("loop", place.0.join("a/loop")).unwrap();
    let mut seen: Vec<_> = store.survey().unwrap().into_iter().map(|entry| entry.name).collect();
    seen.retain(|name| name != "a/loop");
    seen.sort();
    assert_eq!(seen, ["a/.x.1-2.skyloom-part", "a/Thumbs.db", "a/b", "c", "d/e/F", "d/e/f"]);
    assert_eq!(store.set_aside("a/Thumbs.db").unwrap(), "aside/a_Thumbs.db");
    std::fs::write(place.0.join("a/Thumbs.db"), b"another").unwrap();
    assert_eq!(store.set_aside("a/Thumbs.db").unwrap(), "aside/a_Thumbs.db-1");
    assert_eq!(std::fs::read(place.0.join("aside/a_Thumbs.db")).unwrap(), b"own");
    assert!(store.discard("a/.x.1-2.skyloom-part").unwrap() && !store.discard("a/.x.1-2.skyloom-part").unwrap());
    for out in ["../x", "/etc/passwd", "", "a/../../x"] {
        assert!(matches!(store.set_aside(out), Err(StoreError::Key(_))), "{out:?}");
        assert!(matches!(store.discard(out), Err(StoreError::Key(_))), "{out:?}");
    }
}

#[test]
fn leftovers_are_told_by_name_and_age_whichever_way_the_clock_was_set() {
    let now = SystemTime::now();
    let (hours, minute) = (Duration::from_secs(7200), Duration::from_secs(60));
    for (name, modified, is_over) in [
        (".b.1-2.skyloom-part", now - hours, true),
        (".b.1-2.skyloom-part", now + hours, true),
        (".b.1-2.skyloom-part", now - minute, false),
        (".b.1-2.skyloom-part", now + minute, false),
        ("b.skyloom-part", now - hours, false),
        (".b", now - hours, false),
    ] {
        assert_eq!(is_leftover(name, modified, now), is_over, "{name}");
    }
}
