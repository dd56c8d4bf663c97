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
