//! Renderers side by side: each of the fakes says which of them is at what, and goes on when it is told.

use std::collections::BTreeSet;
use std::sync::mpsc;

use skyloom::encode::Written;
use skyloom::render::{Images, RenderError};
use skyloom::request::{Format, Request, TextureKind};
use skyloom::scene::Scene;
use skyloom::tables::TableLibrary;

use super::*;
use crate::fair::Fair;

/// What no test comes near to.
const LONG: Duration = Duration::from_secs(20);
/// Long enough for a thread to begin with what it may.
const SOON: Duration = Duration::from_millis(100);
/// Texels a side of small jobs.
const SMALL: u32 = 1024;
/// The same of large ones.
const LARGE: u32 = 4096;

/// Who renders at what time: jobs are told apart by their times.
type Seen = (usize, u32);

struct Fake {
    number: usize,
    kind: &'static str,
    seen: mpsc::Sender<Seen>,
    released: Arc<Mutex<BTreeSet<u32>>>,
}

impl Render for Fake {
    fn adapter(&self) -> Adapter {
        Adapter { name: "fake".into(), backend: "none".into(), kind: self.kind.into(), driver: "1".into() }
    }

    fn render(&mut self, job: &Arc<Job>, _: &Watch) -> Result<Picture, RenderError> {
        let time = job.request().time_s as u32;
        self.seen.send((self.number, time)).unwrap();
        while !lock(&self.released).contains(&time) {
            std::thread::sleep(Duration::from_millis(1));
        }
        let encode = |_: &mut dyn skyloom::encode::Target| Ok(Written { bits: 8, reason: None });
        Ok(Picture { shape: [1, 1, 1], timings: Vec::new(), encode: Box::new(encode) })
    }
}

struct Service {
    queue: Arc<RenderQueue>,
    made: Arc<Mutex<usize>>,
    seen: mpsc::Receiver<Seen>,
    released: Arc<Mutex<BTreeSet<u32>>>,
}

fn job(sky: u32, time: u32, size: u32) -> Arc<Job> {
    let text = format!(r#"{{"domain": {{"extent_m": {}, "resolution": 16}}, "layers": []}}"#, 1000 + sky);
    let scene = Arc::new(Scene::from_json(text.as_bytes()).unwrap());
    let request =
        Request { size: Some(size), time_s: f64::from(time), ..Request::new(TextureKind::Shadow, Format::F32) };
    Arc::new(Job::prepare(scene, request, &Images::new(), &TableLibrary::new(None), &|_| ()).unwrap())
}

fn client(last: u8) -> Client {
    Client::of([10, 0, 0, last].into())
}

/// A queue whose first two renderers are there.
async fn service(kind: &'static str, side_by_side: usize) -> Service {
    let (made, released) = (Arc::new(Mutex::new(0)), Arc::<Mutex<BTreeSet<u32>>>::default());
    let (sender, seen) = mpsc::channel();
    let (count, let_go) = (Arc::clone(&made), Arc::clone(&released));
    let factory: Factory = Box::new(move || {
        let mut count = lock(&count);
        *count += 1;
        let number = *count - 1;
        Ok(Box::new(Fake { number, kind, seen: sender.clone(), released: Arc::clone(&let_go) }))
    });
    let patience = crate::config::Render::default().patience();
    let queue = RenderQueue::start(factory, 32, 1 << 30, SideBySide::new(side_by_side), patience).unwrap();
    let service = Service { queue: Arc::new(queue), made, seen, released };
    // The second one is made when the first is at a large job.
    let large = service.put(0, 1_000_000, LARGE, 1);
    assert_eq!(service.next(), (0, 1_000_000));
    while *lock(&service.made) < 2 {
        std::thread::sleep(Duration::from_millis(1));
    }
    service.end(1_000_000);
    large.await.unwrap();
    service
}

impl Service {
    fn put(&self, sky: u32, time: u32, size: u32, who: u8) -> tokio::task::JoinHandle<()> {
        let queue = Arc::clone(&self.queue);
        tokio::spawn(async move {
            let end = Instant::now() + 10 * LONG;
            drop(queue.render(job(sky, time, size), &client(who), end, Arc::default()).await.unwrap());
        })
    }

    /// What is begun next.
    fn next(&self) -> Seen {
        self.seen.recv_timeout(LONG).unwrap()
    }

    fn end(&self, time: u32) {
        lock(&self.released).insert(time);
    }

    /// The renderer of a job that is done at once.
    async fn renderer(&self, sky: u32, time: u32) -> usize {
        self.end(time);
        self.put(sky, time, SMALL, 1).await.unwrap();
        self.next().0
    }

    async fn waiting(&self, count: usize) {
        while self.queue.waiting() != count {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn two_skies_are_rendered_at_a_time_and_each_stays_where_its_light_is() {
    let service = service("software", 2).await;
    let first = service.put(1, 1, SMALL, 1);
    let (of_first, _) = service.next();
    let second = service.put(2, 2, SMALL, 1);
    let (of_second, _) = service.next();
    assert_ne!(of_first, of_second, "both are under way");
    (1..=2).for_each(|time| service.end(time));
    first.await.unwrap();
    second.await.unwrap();
    assert_eq!(service.renderer(1, 10).await, of_first);
    assert_eq!(service.renderer(2, 20).await, of_second);
    // One of the same sky waits a little, and is then made where there is nothing to do.
    let held = service.put(1, 30, SMALL, 1);
    assert_eq!(service.next(), (of_first, 30));
    let start = Instant::now();
    let other = service.put(1, 31, SMALL, 1);
    assert_eq!(service.next(), (of_second, 31), "its light is made once more");
    assert!(start.elapsed() >= SOON, "though it could have been there soon");
    (30..=31).for_each(|time| service.end(time));
    held.await.unwrap();
    other.await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn a_real_device_has_one_job_at_a_time_unless_the_settings_want_more() {
    for (kind, side_by_side, is_alone) in [("discrete", 0, true), ("discrete", 2, false), ("software", 1, true)] {
        let service = service(kind, side_by_side).await;
        let first = service.put(1, 1, SMALL, 1);
        assert_eq!(service.next().1, 1);
        let second = service.put(2, 2, SMALL, 1);
        assert_eq!(service.seen.recv_timeout(if is_alone { SOON } else { LONG }).is_err(), is_alone, "{kind}");
        (1..=2).for_each(|time| service.end(time));
        first.await.unwrap();
        second.await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn one_large_job_runs_at_a_time_and_small_ones_of_its_sky_go_past_it() {
    let service = service("software", 2).await;
    let large = service.put(1, 1, LARGE, 1);
    assert_eq!(service.next(), (0, 1));
    let second = service.put(2, 2, LARGE, 2);
    service.waiting(1).await;
    assert!(service.seen.recv_timeout(SOON).is_err());
    for time in 10..13 {
        assert_eq!(service.renderer(1, time).await, 1);
    }
    // Beside a large one two small ones are rendered at a time as well.
    let small = [20, 21].map(|time| service.put(time, time, SMALL, 1));
    let renderers = BTreeSet::from([service.next().0, service.next().0]);
    assert_eq!(renderers, BTreeSet::from([1, 2]));
    (20..22).for_each(|time| service.end(time));
    for one in small {
        one.await.unwrap();
    }
    service.end(1);
    assert_eq!(service.next(), (0, 2));
    service.end(2);
    large.await.unwrap();
    second.await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn turns_are_fair_and_nobody_is_forgotten() {
    let service = service("software", 2).await;
    // Who has much in line, of skies that are at home, and who comes after with little.
    let mut all = vec![service.put(1, 1, SMALL, 1)];
    service.next();
    all.push(service.put(2, 2, SMALL, 1));
    service.next();
    for time in 3..13 {
        all.push(service.put(1 + time % 2, time, SMALL, 1));
        service.waiting(time as usize - 2).await;
    }
    all.push(service.put(3, 100, SMALL, 2));
    service.waiting(11).await;
    let mut order = Vec::new();
    let mut under_way = vec![1, 2];
    while let Some(time) = under_way.pop() {
        service.end(time);
        if order.len() < 11 {
            let (_, next) = service.next();
            order.push(next);
            under_way.insert(0, next);
        }
    }
    for one in all {
        one.await.unwrap();
    }
    assert!(order[..3].contains(&100), "{order:?}");
    assert_eq!(order.iter().collect::<BTreeSet<_>>().len(), 11);
}

/// By the rules alone, without threads.
#[test]
fn a_job_waits_for_its_light_no_longer_than_it_takes_to_make_and_for_nothing_that_takes_longer() {
    let mut pool = Pool::new(2);
    pool.go_side_by_side(2);
    pool.has(0, true);
    let mut line = Fair::default();
    let mut put = |sky: u32, size: u32| {
        let job = job(sky, 0, size);
        let (cost, since) = (cost::cost(&job), Instant::now());
        let (reply, _) = oneshot::channel();
        let order = Order { job, watch: Watch::default(), reply, since, again: false };
        line.push(client(1), cost, cost > cost::LARGE, order);
        line.pop(|_| true).unwrap()
    };
    let waits = |pool: &Pool, number: usize, one: &crate::fair::Waiting<Order>| {
        pool.takes_from(number, one).map(|from| from.duration_since(one.item.since).as_secs_f64())
    };
    let (small, other, large) = (put(1, SMALL), put(2, SMALL), put(1, LARGE));
    assert_eq!(waits(&pool, 1, &small), None, "the first one has nothing to do");
    pool.has(1, true);
    pool.begin(0, &small);
    pool.done(0, small.cost, None);
    assert_eq!([0, 1].map(|number| waits(&pool, number, &other)), [None, Some(0.0)], "it has fewer skies");
    pool.begin(0, &small);
    let patience = waits(&pool, 1, &small).unwrap();
    assert!((0.3..0.8).contains(&patience), "half a second, by what is known of a software device: {patience}");
    assert_eq!(waits(&pool, 1, &large), None);
    // What others waited for it counts.
    std::thread::sleep(SOON);
    pool.begin(0, &small);
    let less = waits(&pool, 1, &small).unwrap();
    assert!(less <= patience - SOON.as_secs_f64(), "{less}");
    // The large one of its sky takes far longer.
    pool.done(0, small.cost, None);
    pool.begin(0, &large);
    assert_eq!(waits(&pool, 1, &small), Some(0.0));
    // Those who wait share what is done side by side.
    pool.done(0, large.cost, None);
    let alone = pool.wait_s(false, 4e6);
    pool.has(1, false);
    assert!((pool.wait_s(false, 4e6) / alone - 2.0).abs() < 1e-9);
    assert_eq!(waits(&pool, 0, &small), Some(0.0));
}
