//! What was rendered is kept in the store.

use super::*;

#[tokio::test(flavor = "multi_thread")]
async fn twenty_different_misses_at_once_are_all_in_the_store_in_the_end() {
    let service = service(Vec::new(), 32, 30);
    let sky = service.sky().await;
    let misses: Vec<_> = (0..20).map(|time| service.background(format!("{sky}/shadow.f32?time={time}"))).collect();
    for miss in misses {
        assert_eq!(miss.await.unwrap().status(), StatusCode::OK);
    }
    let folder = service.data.path().join("textures");
    let names = || {
        let names = std::fs::read_dir(&folder).into_iter().flatten().map(|entry| entry.unwrap().file_name());
        // What is being written has a name with a dot before it.
        names.filter(|name| !name.to_str().unwrap().starts_with('.')).count()
    };
    while names() < 20 {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    assert_eq!(service.app.replies.unkept(), 0);
}
