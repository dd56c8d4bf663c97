//! What a bad disk or a crash does to the data folder: noticed, told, mended by sending the same again; never a wrong picture.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::harness::{Server, scene};
use crate::images::ramp;

/// Ways in which a file goes bad.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Damage {
    First,
    Middle,
    Last,
    Empty,
    Cut,
    Longer,
    /// A folder with something in it stands in its place.
    Folder,
    /// Another file of its kind stands in its place.
    Other,
    Gone,
}

impl Damage {
    pub(crate) const ALL: [Self; 9] = [
        Self::First,
        Self::Middle,
        Self::Last,
        Self::Empty,
        Self::Cut,
        Self::Longer,
        Self::Folder,
        Self::Other,
        Self::Gone,
    ];

    pub(crate) fn strike(self, path: &Path, other: &Path) {
        let bytes = fs::read(path).unwrap();
        let flipped = |at: usize| {
            let mut bytes = bytes.clone();
            bytes[at] ^= 0x10;
            bytes
        };
        let bad = match self {
            Self::First => flipped(0),
            Self::Middle => flipped(bytes.len() / 2),
            Self::Last => flipped(bytes.len() - 1),
            Self::Empty => Vec::new(),
            Self::Cut => bytes[..bytes.len() / 2].to_vec(),
            Self::Longer => [&bytes[..], b"\0"].concat(),
            Self::Other => fs::read(other).unwrap(),
            Self::Folder | Self::Gone => {
                fs::remove_file(path).unwrap();
                if matches!(self, Self::Folder) {
                    fs::create_dir(path).unwrap();
                    fs::write(path.join("own"), b"kept").unwrap();
                }
                return;
            }
        };
        fs::write(path, bad).unwrap();
    }
}

/// A server that keeps no finished textures: they would be right whatever became of what they were made from.
fn start(data: &Path) -> Server {
    let settings = data.join("settings.toml");
    fs::write(&settings, "[store]\ntexture_bytes = 0\n").unwrap();
    Server::start(data, &["--config", settings.to_str().unwrap()], &[])
}

fn image_of(side: u32) -> Vec<u8> {
    ramp(8 + side)
}

/// A scene whose thickness is an image.
fn mapped(image: &Value) -> Value {
    let mut mapped = scene();
    mapped["layers"][0]["thickness"] = json!({ "kind": "image", "image": image, "scale_m": 300 });
    mapped
}

/// An image, a sky that names it, and a texture as it should be.
struct Kept {
    damage: Damage,
    side: u32,
    name: String,
    sky: String,
    texture: String,
    tag: String,
    body: Vec<u8>,
}

fn keep(server: &Server) -> Vec<Kept> {
    let keep = |(damage, side): (Damage, u32)| {
        let image = server.post_image("image/png", &image_of(side)).json()["sha256"].clone();
        let sky = server.sky(&mapped(&image));
        let texture = format!("{sky}/thickness.f32?size=16");
        let answer = server.get(&texture);
        assert_eq!(answer.status, 200, "{}", answer.text());
        let name = image.as_str().unwrap().to_owned();
        Kept { damage, side, name, sky, tag: answer.header("etag").to_owned(), body: answer.body, texture }
    };
    Damage::ALL.into_iter().zip(0..).map(keep).collect()
}

fn file(data: &Path, kept: &Kept) -> PathBuf {
    data.join("images").join(&kept.name)
}

#[test]
fn a_damaged_image_is_told_and_never_drawn_until_it_is_uploaded_again() {
    let data = tempfile::tempdir().unwrap();
    let server = start(data.path());
    let all = keep(&server);
    let other = server.post_image("image/png", &ramp(40)).json()["sha256"].as_str().unwrap().to_owned();
    let other = data.path().join("images").join(other);
    // What was decoded before is still right.
    for kept in &all {
        kept.damage.strike(&file(data.path(), kept), &other);
        let answer = server.get(&format!("{}&time=1", kept.texture));
        assert!(answer.status == 200 && answer.body == kept.body, "{:?}: {}", kept.damage, answer.text());
    }
    server.kill();

    let server = start(data.path());
    for text in ["a stored image is damaged", "was damaged and is replaced", "a folder stands in the place of a file"] {
        server.expect_in_log(text);
    }
    for kept in &all {
        let is_absent = matches!(kept.damage, Damage::Folder | Damage::Gone);
        let told = |problem: &Value| {
            let error = &problem["errors"][0];
            assert_eq!(error["pointer"], "/layers/0/thickness/image", "{:?}: {problem}", kept.damage);
            let detail = error["detail"].as_str().unwrap();
            assert!(detail.contains(&kept.name) && detail.contains("POST /v1/images"), "{:?}: {detail}", kept.damage);
            assert_eq!(detail.contains("damaged"), !is_absent, "{:?}: {detail}", kept.damage);
        };
        for method in ["GET", "HEAD"] {
            let answer = server.ask(method, &kept.texture, &[], b"");
            assert_eq!(answer.status, 422, "{:?}: {}", kept.damage, answer.text());
        }
        let problem = server.get(&kept.texture).problem(422);
        assert_eq!(problem["type"], "/problems/lost-image");
        told(&problem);
        // The sky itself is as it was, but no new one is lit by the image.
        assert_eq!(server.get(&kept.sky).status, 200);
        let mut another = mapped(&json!(kept.name));
        another["sun"]["zenith_deg"] = 11.into();
        let problem = server.post_scene(another.to_string().as_bytes()).problem(422);
        assert_eq!(problem["type"], "/problems/invalid-scene");
        told(&problem);
        // Mended by the same file.
        let again = server.post_image("image/png", &image_of(kept.side));
        assert_eq!((again.status, &again.json()["sha256"]), (201, &json!(kept.name)), "{:?}", kept.damage);
        assert_eq!(server.post_image("image/png", &image_of(kept.side)).status, 200);
        assert_eq!(fs::read(file(data.path(), kept)).unwrap(), image_of(kept.side));
        let answer = server.get(&kept.texture);
        assert!(answer.status == 200 && answer.body == kept.body, "{:?}: {}", kept.damage, answer.text());
        assert_eq!(answer.header("etag"), kept.tag);
    }
    server.kill();

    let server = start(data.path());
    for kept in &all {
        let answer = server.get(&kept.texture);
        assert!(answer.status == 200 && answer.body == kept.body, "{:?}: {}", kept.damage, answer.text());
    }
    let aside = fs::read_dir(data.path().join("images")).unwrap().map(|entry| entry.unwrap().path().join("own"));
    assert_eq!(aside.filter(|own| own.is_file()).count(), 1, "what stood in the way is kept");
}

#[test]
fn a_damaged_sky_is_told_and_can_be_registered_again_for_good() {
    let data = tempfile::tempdir().unwrap();
    let server = start(data.path());
    let sun = |zenith: usize| {
        let mut own = scene();
        own["sun"]["zenith_deg"] = zenith.into();
        own
    };
    let skies: Vec<String> = (0..Damage::ALL.len()).map(|i| server.sky(&sun(20 + i))).collect();
    let path = |sky: &str| data.path().join("skies").join(format!("{}.json", sky.rsplit_once('/').unwrap().1));
    let other = server.sky(&sun(50));
    for (damage, sky) in Damage::ALL.into_iter().zip(&skies) {
        damage.strike(&path(sky), &path(&other));
        // Those who have it go on having it.
        assert_eq!(server.get(sky).status, 200, "{damage:?}");
    }
    server.kill();

    let server = start(data.path());
    for text in ["a stored sky is damaged", "was damaged and is replaced", "a folder stands in the place of a file"] {
        server.expect_in_log(text);
    }
    for (i, (damage, sky)) in Damage::ALL.into_iter().zip(&skies).enumerate() {
        for path in [sky.clone(), format!("{sky}/shadow.f32?size=8"), format!("{sky}/plan"), format!("{sky}/frames")] {
            let problem = server.get(&path).problem(404);
            let detail = problem["detail"].as_str().unwrap();
            let is_absent = matches!(damage, Damage::Folder | Damage::Gone);
            assert_eq!(
                detail.contains("damaged") && detail.contains("POST /v1/skies"),
                !is_absent,
                "{damage:?}: {detail}"
            );
        }
        let again = server.post_scene(sun(20 + i).to_string().as_bytes());
        assert_eq!((again.status, again.header("location")), (201, sky.as_str()), "{damage:?}: {}", again.text());
        assert_eq!(server.post_scene(sun(20 + i).to_string().as_bytes()).status, 200, "{damage:?}");
        assert_eq!(server.get(&format!("{sky}/shadow.f32?size=8")).status, 200, "{damage:?}");
    }
    server.kill();

    let server = start(data.path());
    for (damage, sky) in Damage::ALL.into_iter().zip(&skies) {
        assert_eq!(server.get(sky).status, 200, "{damage:?}");
    }
}

#[test]
fn a_sky_or_an_image_that_vanishes_while_the_server_runs_is_kept_by_posting_it_again() {
    let data = tempfile::tempdir().unwrap();
    let server = start(data.path());
    let image = server.post_image("image/png", &ramp(9)).json()["sha256"].clone();
    let sky = server.sky(&mapped(&image));
    let before = server.get(&format!("{sky}/thickness.f32?size=8"));
    fs::remove_dir_all(data.path().join("skies")).unwrap();
    fs::remove_dir_all(data.path().join("images")).unwrap();
    // From memory; but nothing new is built on what is not there.
    assert_eq!(server.get(&format!("{sky}/thickness.f32?size=8&time=1")).body, before.body);
    server.post_scene(mapped(&image).to_string().as_bytes()).names(422, "/layers/0/thickness/image");
    assert_eq!(server.post_image("image/png", &ramp(9)).status, 201);
    // Others may have this sky: it is none that its sender alone knows.
    assert_eq!(server.post_scene(mapped(&image).to_string().as_bytes()).status, 200);
    server.kill();

    let server = start(data.path());
    let after = server.get(&format!("{sky}/thickness.f32?size=8"));
    assert!(after.status == 200 && after.body == before.body, "{}", after.text());
    fs::remove_dir_all(data.path().join("skies")).unwrap();
    assert_eq!(server.ask("DELETE", &sky, &[], b"").status, 204);
    server.get(&sky).problem(404);
    server.ask("DELETE", &sky, &[], b"").problem(404);
}

#[test]
fn damaged_tables_are_made_again_and_give_the_same_picture() {
    let data = tempfile::tempdir().unwrap();
    let server = start(data.path());
    let texture = format!("{}/cloud.f32?size=8&direction=30,40&tolerance=0.3", server.sky(&scene()));
    let before = server.get(&texture);
    assert_eq!(before.status, 200, "{}", before.text());
    server.kill();
    let tables = || fs::read_dir(data.path().join("tables")).unwrap().map(|entry| entry.unwrap().path());
    let good: Vec<_> = tables().map(|path| (path.clone(), fs::read(path).unwrap())).collect();
    assert_eq!(good.len(), 2);
    for damage in [Damage::Middle, Damage::Cut, Damage::Folder, Damage::Other] {
        let mut others = good.iter().rev();
        good.iter().for_each(|(path, bytes)| fs::write(path, bytes).unwrap());
        // Each gets what the other was.
        let parted = data.path().join("parted");
        for (path, _) in &good {
            fs::write(&parted, &others.next().unwrap().1).unwrap();
            damage.strike(path, &parted);
        }
        let server = start(data.path());
        server.expect_in_log(match damage {
            Damage::Folder => "a folder stands in the place of a file",
            _ => "kept tables are damaged and are made again",
        });
        let after = server.get(&texture);
        assert!(after.status == 200 && after.body == before.body, "{damage:?}: {}", after.text());
        server.kill();
        for (path, bytes) in &good {
            assert!(fs::read(path).unwrap() == *bytes, "{damage:?}: {} was not mended", path.display());
        }
    }
}

#[test]
fn files_of_others_are_neither_used_nor_counted_nor_touched() {
    let data = tempfile::tempdir().unwrap();
    let settings = data.path().join("skyloom.toml");
    let image = ramp(12);
    fs::write(&settings, format!("[limits]\nskies = 2\nimage_store_bytes = {}\n", image.len() + 10)).unwrap();
    let start = || Server::start(&data.path().join("data"), &["--config", settings.to_str().unwrap()], &[]);
    let server = start();
    let sky = server.sky(&scene());
    let id = sky.rsplit_once('/').unwrap().1.to_owned();
    let sha256 = server.post_image("image/png", &image).json()["sha256"].as_str().unwrap().to_owned();
    let place = |folder: &str, name: &str| data.path().join("data").join(folder).join(name);
    let foreign = [
        place("skies", "README"),
        place("skies", &format!("{}.JSON", id.to_uppercase())),
        place("skies", &format!("{id}.json~")),
        place("skies", ".hidden.1.2.tmp"),
        place("images", "holiday.png"),
        place("images", &sha256.to_uppercase()),
        place("images", &sha256[..63]),
        place("images", ".DS_Store"),
    ];
    for path in &foreign {
        fs::write(path, vec![b'x'; 1000]).unwrap();
    }
    for _ in 0..2 {
        fs::copy(place("skies", &format!("{id}.json")), place("skies", &format!("copy-of-{id}.json"))).unwrap();
    }
    server.kill();

    let server = start();
    server.get(&format!("/v1/skies/{}", id.to_uppercase())).problem(404);
    server.get(&format!("/v1/skies/copy-of-{id}")).problem(404);
    server.ask("DELETE", &format!("/v1/skies/{}", id.to_uppercase()), &[], b"").problem(404);
    server.post_scene(mapped(&json!(sha256.to_uppercase())).to_string().as_bytes()).problem(422);
    assert_eq!(server.post_image("image/png", &image).status, 200);
    assert_eq!(server.post_image("image/png", &ramp(13)).problem(507)["type"], "/problems/store-full");
    // One of two is left.
    let mut own = scene();
    own["sun"]["zenith_deg"] = 12.into();
    let second = server.sky(&own);
    own["sun"]["zenith_deg"] = 13.into();
    server.post_scene(own.to_string().as_bytes()).problem(507);
    assert_eq!(server.ask("DELETE", &second, &[], b"").status, 204);
    server.sky(&own);
    drop(server);
    for path in &foreign {
        assert_eq!(fs::read(path).unwrap(), vec![b'x'; 1000], "{}", path.display());
    }
}

#[test]
fn a_folder_that_is_gone_is_told_and_made_again_when_it_can_be() {
    let data = tempfile::tempdir().unwrap();
    let folder = data.path().join("data");
    let server = Server::start(&folder, &[], &[]);
    server.is_ready();
    fs::remove_dir_all(&folder).unwrap();
    // Where the folder was there is a file, as when a disk is not there.
    fs::write(&folder, b"in the way").unwrap();
    server.expect_in_log("the store cannot be written");
    server.expect_in_log("what is stored cannot be read and is replaced");
    let problem = server.post_scene(scene().to_string().as_bytes()).problem(503);
    assert_eq!(problem["type"], "/problems/store-failed", "{problem}");
    assert_eq!(server.get("/health/ready").problem(503)["type"], "/problems/store-failed");
    fs::remove_file(&folder).unwrap();
    crate::harness::eventually("recovery", || (server.get("/health/ready").status == 200).then_some(()));
    server.goes_on();
}
