//! Who may write, over a real socket.

use skyloom::image::sha256_hex;

use crate::harness::{Server, scene};

#[test]
fn pages_of_others_neither_fill_nor_delete_and_keys_have_their_rights() {
    let data = tempfile::tempdir().unwrap();
    let text = scene().to_string();
    let server = Server::start(&data.path().join("open"), &[], &[]);
    let post = |server: &Server, headers: &[(&str, &str)]| {
        let headers = [&[("content-type", "application/json")], headers].concat();
        server.ask("POST", "/v1/skies", &headers, text.as_bytes())
    };
    let sky = server.sky(&scene());
    for foreign in [("origin", "https://evil.example"), ("host", "evil.example"), ("sec-fetch-site", "cross-site")] {
        assert_eq!(post(&server, &[foreign]).problem(403)["type"], "/problems/forbidden");
        server.ask("DELETE", &sky, &[foreign], b"").problem(403);
        server.ask("POST", "/v1/images", &[foreign, ("content-type", "image/png")], b"x").problem(403);
        assert_eq!(server.ask("GET", &sky, &[foreign], b"").status, 200);
    }
    let own = format!("http://{}", server.host());
    assert_eq!(post(&server, &[("origin", &own), ("sec-fetch-site", "same-origin")]).status, 200);
    assert_eq!(server.ask("DELETE", &sky, &[("origin", &own)], b"").status, 204);
    drop(server);

    let key = |name: &str, rights: &str| {
        format!("{{ name = {name:?}, sha256 = {:?}, rights = [{rights}] }}", sha256_hex(name.as_bytes()))
    };
    let keys = [key("writer", "\"read\", \"register\""), key("owner", "\"read\", \"admin\"")].join(", ");
    let server = Server::with_settings(data.path(), &format!("[access]\nanonymous = [\"read\"]\nkeys = [{keys}]\n"));
    let [writer, owner] = [("authorization", "Bearer writer"), ("authorization", "Bearer owner")];
    let refused = post(&server, &[]);
    assert_eq!(
        (refused.problem(401)["type"].as_str(), refused.header("www-authenticate")),
        (Some("/problems/no-key"), "Bearer")
    );
    post(&server, &[("authorization", "Bearer guess")]).problem(401);
    post(&server, &[owner]).problem(403);
    let written = post(&server, &[writer, ("origin", "https://tools.example")]);
    assert_eq!(written.status, 201, "{}", written.text());
    let sky = written.header("location").to_owned();
    assert_eq!(server.get(&sky).status, 200);
    server.ask("DELETE", &sky, &[writer], b"").problem(403);
    assert_eq!(server.ask("DELETE", &sky, &[owner], b"").status, 204);
}

#[test]
fn pages_of_other_origins_use_a_server_that_names_them() {
    const HEADERS: [&str; 4] = ["ETag", "Server-Timing", "Retry-After", "Skyloom-Depth"];
    let data = tempfile::tempdir().unwrap();
    let page = ("origin", "https://tools.example");
    let asks = |method| [("access-control-request-method", method), ("access-control-request-headers", "content-type")];
    let preflight = |server: &Server, origin, path: &str, method| {
        server.ask("OPTIONS", path, &[&[origin], &asks(method)[..]].concat(), b"")
    };
    let post = |server: &Server, origin| {
        let headers = [origin, ("content-type", "application/json"), ("sec-fetch-site", "cross-site")];
        server.ask("POST", "/v1/skies", &headers, scene().to_string().as_bytes())
    };

    let closed = Server::start(&data.path().join("closed"), &[], &[]);
    for refused in [preflight(&closed, page, "/v1/skies", "POST"), post(&closed, page)] {
        let detail = refused.problem(403)["detail"].as_str().unwrap().to_owned();
        assert!(detail.contains("[access] cors = [\"https://tools.example\"]"), "{detail}");
        assert!(!refused.headers.contains_key("access-control-allow-origin"));
    }
    let limits = closed.ask("GET", "/v1/limits", &[page], b"");
    assert_eq!((limits.status, limits.headers.contains_key("access-control-allow-origin")), (200, false));
    drop(closed);

    let named = Server::with_settings(data.path(), "[access]\ncors = [\"https://tools.example\"]\n");
    for (path, method) in
        [("/v1/skies", "POST"), ("/v1/skies/0/cloud.exr", "GET"), ("/v1/images", "POST"), ("/v1/skies/0", "DELETE")]
    {
        let answer = preflight(&named, page, path, method);
        assert_eq!((answer.status, answer.body.len()), (204, 0), "{path}");
        assert_eq!(answer.header("access-control-allow-origin"), page.1);
        let (methods, headers) =
            (answer.header("access-control-allow-methods"), answer.header("access-control-allow-headers"));
        assert!(methods.contains(method) && headers.contains("content-type") && headers.contains("authorization"));
        preflight(&named, ("origin", "https://evil.example"), path, method).problem(403);
    }
    let written = post(&named, page);
    assert_eq!(written.status, 201, "{}", written.text());
    assert_eq!(written.header("access-control-allow-origin"), page.1);
    post(&named, ("origin", "https://evil.example")).problem(403);
    let sky = written.header("location").to_owned();
    let file = format!("{sky}/shadow.f32?size=4");
    for (path, status) in [(file.as_str(), 200), ("/v1/skies/0", 404), ("/v1/nothing", 404)] {
        let answer = named.ask("GET", path, &[page], b"");
        assert_eq!(answer.status, status, "{path}");
        assert_eq!((answer.header("access-control-allow-origin"), answer.header("vary")), (page.1, "origin"), "{path}");
        assert!(HEADERS.iter().all(|name| answer.header("access-control-expose-headers").contains(name)));
        let other = named.ask("GET", path, &[("origin", "https://evil.example")], b"");
        assert!(!other.headers.contains_key("access-control-allow-origin"), "{path}");
        // A cache has to know that replies differ.
        assert_eq!(other.header("vary"), "origin", "{path}");
    }
    drop(named);

    // A key does not come with a preflight request; everybody may read, and write with a key.
    let key =
        format!("keys = [{{ name = \"ci\", sha256 = {:?}, rights = [\"read\", \"register\"] }}]", sha256_hex(b"ci"));
    let open = Server::with_settings(data.path(), &format!("[access]\ncors = [\"*\"]\n{key}\n"));
    assert_eq!(preflight(&open, page, "/v1/skies", "POST").status, 204);
    assert_eq!(post(&open, page).problem(403)["type"], "/problems/forbidden");
    let refused = open.ask("GET", "/v1/limits", &[page], b"");
    assert_eq!((refused.status, refused.header("access-control-allow-origin")), (401, "*"));
    let with_key = [page, ("authorization", "Bearer ci")];
    let answer = open.ask("GET", "/v1/limits", &with_key, b"");
    assert_eq!((answer.status, answer.header("access-control-allow-origin")), (200, "*"));
    assert!(!answer.headers.contains_key("vary"));
    let json = [&with_key[..], &[("content-type", "application/json"), ("sec-fetch-site", "cross-site")]].concat();
    let sky = open.ask("POST", "/v1/skies", &json, scene().to_string().as_bytes()).header("location").to_owned();
    let events =
        open.ask("GET", &format!("{sky}/frames?count=1"), &[page, with_key[1], ("accept", "text/event-stream")], b"");
    assert_eq!((events.status, events.header("access-control-allow-origin")), (200, "*"));
    assert!(events.text().contains("event: frame"));
}
