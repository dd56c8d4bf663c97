#!/usr/bin/env python3
"""Serves this folder, and hands what begins with /v1/ to a skyloom server: page and textures then have one origin."""
import sys, urllib.error, urllib.request
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

SERVER = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8080"
PORT = int(sys.argv[2]) if len(sys.argv) > 2 else 8000


class Handler(SimpleHTTPRequestHandler):
    def hand_on(self):
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0)) or None
        headers = {name: self.headers[name] for name in ("Content-Type", "Accept", "If-None-Match") if self.headers[name]}
        try:
            reply = urllib.request.urlopen(urllib.request.Request(SERVER + self.path, body, headers, method=self.command))
        except urllib.error.HTTPError as error:
            reply = error
        except urllib.error.URLError as error:
            return self.send_error(502, f"no skyloom server at {SERVER}", str(error.reason))
        with reply:
            self.send_response(reply.status)
            for name, value in reply.headers.items():
                if name.lower() not in ("transfer-encoding", "connection", "date", "server"):
                    self.send_header(name, value)
            self.end_headers()
            try:
                while part := reply.read1(65536):  # frames are to arrive when they are sent
                    self.wfile.write(part)
                    self.wfile.flush()
            except (BrokenPipeError, ConnectionResetError):
                pass

    def do_GET(self):
        self.hand_on() if self.path.startswith("/v1/") else super().do_GET()

    do_POST = hand_on

    def log_message(self, *_):
        pass


print(f"open http://127.0.0.1:{PORT}/", flush=True)
ThreadingHTTPServer(("127.0.0.1", PORT), Handler).serve_forever()
