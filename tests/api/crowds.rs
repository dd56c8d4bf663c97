//! Clients that keep the server waiting do not keep others from it: all the time somebody else asks, over a new connection each time, whether
//! it lives and for a texture that is in memory.
//!
//! `cargo test` allows for a machine that is busy with other tests; `make load` runs these one by one, and holds them to a second.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::harness::{Server, eventually, scene};
use crate::images::ramp;

/// What an idle server answers in milliseconds takes no longer than this beside a crowd: a client that is waited for gives way
/// after a second, and machines that run tests are busy.
const SOON: Duration = Duration::from_secs(6);

fn soon<T>(what: &str, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let done = work();
    let took = start.elapsed();
    eprintln!("{what}: {} ms beside the crowd", took.as_millis());
    assert!(took < SOON, "{what} took {took:?}");
    done
}

/// What somebody else may have to wait for at most, whatever the crowd does.
fn bound() -> Duration {
    if std::env::var_os("SKYLOOM_LOAD_S").is_some() { Duration::from_secs(1) } else { SOON }
}

/// Somebody else, who asks again and again until he has seen enough.
struct Bystander {
    is_over: Arc<AtomicBool>,
    asks: JoinHandle<[(usize, Duration); 2]>,
}

impl Bystander {
    /// Keeps a texture, and asks from now on.
    fn of(server: &Server) -> Self {
        server.is_ready();
        let texture = format!("{}/shadow.f32?size=16", server.sky(&scene()));
        assert_eq!(server.get(&texture).status, 200);
        let (host, is_over) = (server.host().to_owned(), Arc::<AtomicBool>::default());
        let stop = Arc::clone(&is_over);
        let asks = std::thread::spawn(move || {
            let mut seen = [(0, Duration::ZERO); 2];
            while !stop.load(Ordering::Relaxed) {
                for (path, (count, longest)) in ["/health/live", &texture].into_iter().zip(&mut seen) {
                    let start = Instant::now();
                    let answer = asked_anew(&host, path);
                    assert!(answer.starts_with(b"HTTP/1.1 200"), "{path}: {}", String::from_utf8_lossy(&answer));
                    (*count, *longest) = (*count + 1, start.elapsed().max(*longest));
                }
                std::thread::sleep(Duration::from_millis(50));
            }
            seen
        });
        Self { is_over, asks }
    }

    /// What took him longest.
    fn end(self) {
        self.is_over.store(true, Ordering::Relaxed);
        let seen = self.asks.join().unwrap();
        for (what, (count, longest)) in ["a probe", "a kept texture"].into_iter().zip(seen) {
            eprintln!("{what}: {count} times, {} ms at most beside the crowd", longest.as_millis());
            assert!(count > 0 && longest < bound(), "{what} took {longest:?}");
        }
    }
}

/// Memory of a server before a crowd came.
struct Grown<'a> {
    before: u64,
    server: &'a Server,
}

/// Bytes that a server has, where the system tells it.
fn memory(server: &Server) -> u64 {
    #[cfg(target_os = "linux")]
    return server.memory();
    #[cfg(not(target_os = "linux"))]
    0
}

impl<'a> Grown<'a> {
    /// Waits for the end of warming up: more renderers are made ten seconds after the first texture, of a hundred MiB or more each, on a busy
    /// machine slowly.
    fn of(server: &'a Server) -> Self {
        std::thread::sleep(Duration::from_secs(12));
        let before = eventually("the end of warming up", || {
            let before = memory(server);
            std::thread::sleep(Duration::from_secs(6));
            (memory(server) < before + (1 << 20)).then_some(before)
        });
        Self { before, server }
    }

    /// It takes no more than so many MiB beside what it took.
    fn is_at_most(&self, most: u64, what: &str) {
        let grown = memory(self.server).saturating_sub(self.before) >> 20;
        eprintln!("{what} take {grown} MiB");
        assert!(grown < most, "{what} take {grown} MiB");
    }
}

/// An answer over a connection of its own. Where the machine is busy a full server may give up a connection whose head it has not read yet: then
/// one asks again, and what that takes counts. It ends without a byte where the head had not arrived, and by a reset where it lay unread.
fn asked_anew(host: &str, path: &str) -> Vec<u8> {
    let ask = || {
        let mut stream = TcpStream::connect(host)?;
        stream.set_read_timeout(Some(10 * SOON))?;
        let head = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
        stream.write_all(head.as_bytes())?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).map(|_| answer)
    };
    let start = Instant::now();
    loop {
        let answer = ask();
        let given_up = match &answer {
            Ok(answer) => answer.is_empty(),
            Err(error) => error.kind() == std::io::ErrorKind::ConnectionReset,
        };
        match answer {
            _ if given_up && start.elapsed() < bound() => {
                eprintln!("{path}: asked again after {} ms", start.elapsed().as_millis());
            }
            Ok(answer) => return answer,
            Err(error) => panic!("{path}: {error}"),
        }
    }
}

/// Whether the other end has closed; what it sends is not read.
fn is_cut(stream: &TcpStream) -> bool {
    stream.set_nonblocking(true).unwrap();
    let mut one = [0];
    let seen = stream.peek(&mut one);
    matches!(seen, Ok(0)) || seen.is_err_and(|error| error.kind() != std::io::ErrorKind::WouldBlock)
}

#[test]
fn clients_that_neither_read_nor_send_give_way_and_are_cut() {
    let data = tempfile::tempdir().unwrap();
    let settings = "[server]\nadmin_listen = \"127.0.0.1:0\"\nconnections = 512\nconnections_per_client = 512\n\
                    header_timeout_s = 2\nstall_timeout_s = 3\n";
    let server = Server::with_settings(data.path(), settings);
    let bystander = Bystander::of(&server);
    let before = Grown::of(&server);
    let connect = |text: &str| {
        let mut stream = TcpStream::connect(server.host()).unwrap();
        stream.set_write_timeout(Some(Duration::from_secs(1))).unwrap();
        // More than the buffers of both ends hold, if need be.
        let _ = stream.write_all(text.as_bytes());
        stream
    };
    let many = "GET /v1/presets HTTP/1.1\r\nHost: localhost\r\n\r\n".repeat(4000);
    // They take every place there is, and each asks before it is known that it reads nothing.
    let deaf: Vec<_> = std::thread::scope(|scope| {
        let connect = || (0..32).map(|_| connect(&many)).collect::<Vec<_>>();
        let all: Vec<_> = (0..16).map(|_| scope.spawn(connect)).collect();
        all.into_iter().flat_map(|some| some.join().unwrap()).collect()
    });
    assert_eq!(deaf.len(), 512);
    soon("a probe", || assert_eq!(server.probe("/health/live").status, 200));
    assert_eq!(server.probe("/health").status, 200);
    assert_eq!(server.probe("/v1/presets").status, 404, "nothing else is there");
    soon("a request", || assert_eq!(server.get("/v1/limits").status, 200));
    // Nobody reads, and all are rid of within their time.
    let start = Instant::now();
    let dribbling = connect("GET /");
    let silent = connect("");
    eventually("the dribbling client to be cut", || {
        let _ = (&dribbling).write_all(b"x");
        std::thread::sleep(Duration::from_millis(50));
        is_cut(&dribbling).then_some(())
    });
    eventually("the silent client to be cut", || is_cut(&silent).then_some(()));
    assert!(start.elapsed() < SOON, "{:?}", start.elapsed());
    let open = || server.probe("/metrics").metric("skyloom_connections").unwrap();
    eventually("all of the crowd to be cut", || (open() <= 2.0).then_some(()));
    drop(deaf);
    soon("a request afterwards", || assert_eq!(server.get("/v1/limits").status, 200));
    bystander.end();
    before.is_at_most(96, "512 clients that read nothing");
}

#[test]
fn stalled_uploads_keep_nobody_from_an_upload_and_end() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::with_settings(data.path(), "[server]\nstall_timeout_s = 2\n");
    let bystander = Bystander::of(&server);
    let before = Grown::of(&server);
    let stalled: Vec<_> = (0..40)
        .map(|_| {
            let mut stream = TcpStream::connect(server.host()).unwrap();
            let head = "POST /v1/images HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/png\r\nContent-Length: 60000000\r\n\r\n";
            stream.write_all(head.as_bytes()).unwrap();
            stream.write_all(&[0; 1000]).unwrap();
            stream
        })
        .collect();
    std::thread::sleep(Duration::from_millis(300));
    soon("an upload", || assert_eq!(server.post_image("image/png", &ramp(17)).status, 201));
    let mut first = stalled.into_iter().next().unwrap();
    let mut answer = String::new();
    first.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 408"), "{answer}");
    bystander.end();
    before.is_at_most(96, "40 uploads that stall");
}

#[test]
fn a_file_that_its_decoder_did_not_expect_is_unreadable_like_any_other() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    // The decoder's own words, and ours.
    server.expect_in_log("panicked at");
    server.expect_in_log("a decoder panicked");
    let good = ramp(8);
    // Signature, header, then a palette of a length that no palette has, for colours of every kind.
    for (colour, length) in [(3, 4), (3, 2), (3, 0), (3, 767), (2, 5), (6, 1)] {
        let mut png = good[..8].to_vec();
        let chunk = |png: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]| {
            png.extend(u32::try_from(data.len()).unwrap().to_be_bytes());
            png.extend(kind);
            png.extend(data);
            let mut sum = flate2::Crc::new();
            sum.update(kind);
            sum.update(data);
            png.extend(sum.sum().to_be_bytes());
        };
        chunk(&mut png, b"IHDR", &[0, 0, 0, 2, 0, 0, 0, 2, 8, colour, 0, 0, 0]);
        chunk(&mut png, b"PLTE", &vec![7; length]);
        let mut packed = Vec::new();
        let rows = vec![0_u8; 2 * (1 + 2 * usize::from(colour.max(1)))];
        flate2::bufread::ZlibEncoder::new(rows.as_slice(), flate2::Compression::fast())
            .read_to_end(&mut packed)
            .unwrap();
        chunk(&mut png, b"IDAT", &packed);
        chunk(&mut png, b"IEND", &[]);
        let answer = server.post_image("image/png", &png);
        assert!([201, 200, 400].contains(&answer.status), "{colour}, {length}: {}", answer.text());
        eprintln!("palette of {length} bytes, colour {colour}: {}", answer.status);
    }
    server.goes_on();
}

/// Builds of tables that nobody waits for in the end.
const BUILDS: u32 = 40;

#[test]
fn tables_in_the_making_hold_nobody_up_who_has_his_and_those_of_clients_that_left_are_given_up() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::with_settings(data.path(), "[limits]\nleast_tolerance = 0.001\n");
    server.is_ready();
    let ready = server.sky(&scene());
    assert_eq!(server.get(&format!("{ready}/cloud.f32?size=4&tolerance=0.1")).status, 200);
    server.get(&format!("{ready}/cloud.f32?size=4&tolerance=0.0009")).names(422, "tolerance");
    let bystander = Bystander::of(&server);
    let before = Grown::of(&server);
    // Large droplets take longest: far longer than all of this.
    let slow: Vec<String> = (0..BUILDS)
        .map(|number| {
            let mut own = scene();
            let droplets =
                json!({ "effective_radius_um": 46.0 + 0.1 * f64::from(number), "broadness": 2, "number_per_cm3": 1 });
            own["layers"][0]["droplets"] = droplets;
            server.sky(&own)
        })
        .collect();
    let leaves: Vec<_> = slow
        .iter()
        .map(|sky| {
            let mut stream = TcpStream::connect(server.host()).unwrap();
            let head = format!("GET {sky}/cloud.f32?size=4&tolerance=0.001 HTTP/1.1\r\nHost: localhost\r\n\r\n");
            stream.write_all(head.as_bytes()).unwrap();
            stream
        })
        .collect();
    let tables = |sky: &String| server.get(sky).json()["tables"].clone();
    eventually("a line", || {
        let places: Vec<_> = slow.iter().filter_map(|sky| tables(sky)["place"].as_u64()).collect();
        let last = u64::from(BUILDS) - 2;
        (places.len() as u64 == last && places.contains(&1) && places.contains(&last)).then_some(())
    });
    soon("a texture whose tables are there", || {
        assert_eq!(server.get(&format!("{ready}/cloud.f32?size=5&tolerance=0.1")).status, 200);
    });
    assert!(slow.iter().any(|sky| tables(sky)["state"] == "waiting"));
    drop(leaves);
    let start = Instant::now();
    eventually("all to be given up", || slow.iter().all(|sky| tables(sky)["state"] == "new").then_some(()));
    eprintln!("given up after {} ms", start.elapsed().as_millis());
    // Solvers ask now and then whether to go on; to their end all would take an hour.
    assert!(start.elapsed() < 8 * SOON, "{:?}", start.elapsed());
    bystander.end();
    before.is_at_most(256, "40 builds that nobody waits for");
}

/// Ten readers that read next to nothing, of textures of 64 MiB each, where there is memory for one.
#[cfg(target_os = "linux")]
#[test]
fn slow_readers_of_large_textures_hold_neither_memory_nor_others_up() {
    const TEXTURE: u64 = 4 * 4096 * 4096;
    let data = tempfile::tempdir().unwrap();
    let settings = "[server]\nstall_timeout_s = 600\nleast_rate = 0\n[cache]\nmemory_bytes = 0\n[store]\ntexture_bytes = 0\n\
                    [limits]\nreply_memory_bytes = 200000000\n[queue]\ntimeout_s = 200\n";
    let server = Server::with_settings(data.path(), settings);
    server.is_ready();
    let sky = server.sky(&scene());
    let bystander = Bystander::of(&server);
    let texture = |time: u32| format!("{sky}/thickness.f32?size=4096&time={time}");
    let first = server.get(&texture(0));
    assert_eq!((first.status, first.body.len() as u64), (200, TEXTURE));
    let before = Grown::of(&server);
    let start = Instant::now();
    let readers: Vec<_> = (1..=10)
        .map(|time| {
            let mut stream = TcpStream::connect(server.host()).unwrap();
            let head = format!("GET {} HTTP/1.1\r\nHost: localhost\r\n\r\n", texture(time));
            stream.write_all(head.as_bytes()).unwrap();
            stream
        })
        .collect();
    for mut reader in &readers {
        let mut head = [0; 15];
        reader.read_exact(&mut head).unwrap();
        assert_eq!(&head, b"HTTP/1.1 200 OK");
    }
    let aside = || server.metric("skyloom_spool_bytes").unwrap() as u64;
    eprintln!("all ten have begun after {} s", start.elapsed().as_secs());
    assert_eq!(aside(), 10 * TEXTURE);
    // In memory all of them would be 640 MiB: here a texture that the renderer keeps at most, and a few pieces each.
    before.is_at_most(64 + 32, "10 readers of 64 MiB");
    // Everybody else is served, the same bytes under the same tag as ever.
    let again = server.get(&texture(0));
    assert!(again.body == first.body && again.header("etag") == first.header("etag"));
    // One of the ten reads on, to its end.
    let mut reader = readers.into_iter().next_back().unwrap();
    let mut rest = Vec::new();
    let mut piece = vec![0; 1 << 20];
    while (rest.len() as u64) < TEXTURE {
        let count = reader.read(&mut piece).unwrap();
        assert!(count > 0, "{} bytes", rest.len());
        rest.extend_from_slice(&piece[..count]);
    }
    assert!(rest.ends_with(&server.get(&texture(10)).body));
    drop(reader);
    eventually("all files to be gone", || (aside() == 0).then_some(()));
    bystander.end();
}

/// Twenty readers that read nothing, of textures of 16 MiB each.
#[cfg(target_os = "linux")]
#[test]
fn readers_that_do_not_read_pin_no_more_than_the_budget() {
    const BUDGET: u64 = 48 << 20;
    let data = tempfile::tempdir().unwrap();
    let settings = format!(
        "[server]\nstall_timeout_s = 3\n[cache]\nmemory_bytes = 0\n[limits]\nreply_memory_bytes = {BUDGET}\nreply_disk_bytes = 0\n"
    );
    let server = Server::with_settings(data.path(), &settings);
    server.is_ready();
    let sky = server.sky(&scene());
    let bystander = Bystander::of(&server);
    let texture = |size: u32, time: u32| format!("{sky}/thickness.f32?size={size}&time={time}");
    assert_eq!(server.get(&texture(2048, 0)).status, 200);
    let before = Grown::of(&server).before;
    let readers: Vec<_> = (1..=20)
        .map(|time| {
            let mut stream = TcpStream::connect(server.host()).unwrap();
            let head = format!("GET {} HTTP/1.1\r\nHost: localhost\r\n\r\n", texture(2048, time));
            stream.write_all(head.as_bytes()).unwrap();
            stream
        })
        .collect();
    let start = Instant::now();
    let mut most = before;
    while start.elapsed() < Duration::from_millis(2500) {
        most = most.max(server.memory());
        std::thread::sleep(Duration::from_millis(20));
    }
    soon("a small texture", || assert_eq!(server.get(&texture(8, 50)).status, 200));
    let grown = (most - before) >> 20;
    eprintln!("20 readers of 16 MiB pin {grown} MiB");
    // Beside the budget a picture or two before and after it is encoded, and what the device keeps of them.
    assert!(grown < (BUDGET >> 20) + 96, "{grown} MiB");
    // Those that do not read are cut, and a large one has room again.
    eventually("room for a large texture", || (server.get(&texture(2048, 51)).status == 200).then_some(()));
    bystander.end();
    drop(readers);
}
