#include "tune/http_server.h"

#include <array>
#include <atomic>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>
#include <httplib.h>
#include <sys/random.h>

#include "producer/format/scene_io.h"
#include "tune/messages.h"
#include "tune/page_files.h"
#include "tune/presets_list.h"

namespace offstage::tune {
namespace {

constexpr int kStreamServers = 2;
constexpr std::size_t kThreads = 24, kStreamThreads = kMostTabs + 2;
constexpr std::size_t kLongestRequest = 32u << 20;  // [bytes]
constexpr std::chrono::seconds kHeartbeat{2};
constexpr const char* kHost = "127.0.0.1";

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error("the system provides no random numbers");
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

/// Compares two texts. The time does not show how many characters of the token are right.
bool equal(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
  return difference == 0;
}

void refuse(httplib::Response& response, int status, const std::string& why) {
  response.status = status;
  response.set_content(why + "\n", "text/plain; charset=utf-8");
}

void send_json(httplib::Response& response, const Json& json, int status = 200) {
  response.status = status;
  response.set_content(dump(json), "application/json");
}

std::string type_of(const std::string& name) {
  const auto ends = [&](const char* ending) { return name.ends_with(ending); };
  if (ends(".html")) return "text/html; charset=utf-8";
  if (ends(".js")) return "text/javascript; charset=utf-8";
  if (ends(".css")) return "text/css; charset=utf-8";
  if (ends(".svg")) return "image/svg+xml";
  return ends(".jpg") ? "image/jpeg" : "application/octet-stream";
}

engine::Detail detail_of(const std::string& name) {
  return name == "draft"     ? engine::Detail::draft
         : name == "preview" ? engine::Detail::preview
                             : engine::Detail::final;
}

}  // namespace

struct HttpServer::Impl {
  Session& session;
  const std::string token = random_token();
  httplib::Server main;
  std::array<httplib::Server, kStreamServers> streams;
  int port = 0;
  std::array<int, kStreamServers> stream_ports{};
  std::array<std::atomic<int>, kStreamServers> stream_tabs{};
  std::vector<std::thread> threads;

  explicit Impl(Session& s) : session(s) {}

  std::string origin() const { return fmt::format("http://{}:{}", kHost, port); }

  /// Checks that apply to every request. The token is the first part of the path.
  void guard(httplib::Server& server, const int& own_port) {
    server.set_pre_routing_handler([this, &own_port](const httplib::Request& request,
                                                     httplib::Response& response) {
      using Handled = httplib::Server::HandlerResponse;
      const std::string host = request.get_header_value("Host"), from = request.get_header_value("Origin");
      const auto is_ours = [](const std::string& text, int any_port) {
        return text == fmt::format("{}:{}", kHost, any_port) || text == fmt::format("localhost:{}", any_port);
      };
      const bool scheme = from.starts_with("http://");
      if (!is_ours(host, own_port)) {
        refuse(response, 403, "This server answers to 127.0.0.1 only.");
      } else if (!from.empty() && !(scheme && is_ours(from.substr(7), port))) {
        refuse(response, 403, "Requests from other pages are refused.");
      } else if (!equal(request.path.substr(0, token.size() + 2), "/" + token + "/")) {
        refuse(response, 403,
               "The address lacks the right token. Open the address that `offstage tune` printed.");
      } else if (request.method == "POST" &&
                 !request.get_header_value("Content-Type").starts_with("application/json")) {
        refuse(response, 415, "Changes are sent as application/json.");
      } else if (request.method != "GET" && request.method != "POST") {
        refuse(response, 405, "Only GET and POST are allowed.");
      } else {
        return Handled::Unhandled;
      }
      return Handled::Handled;
    });
    std::string connect = "'self'";
    for (const int stream : stream_ports)
      connect += fmt::format(" http://{0}:{1} http://localhost:{1}", kHost, stream);
    server.set_default_headers(
        {{"Content-Security-Policy",
          "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: "
          "data:; "
          "connect-src " +
              connect + "; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"},
         {"X-Content-Type-Options", "nosniff"},
         {"Referrer-Policy", "no-referrer"},
         {"Cross-Origin-Opener-Policy", "same-origin"},
         {"Cache-Control", "no-store"}});
    server.set_exception_handler(
        [](const httplib::Request&, httplib::Response& response, std::exception_ptr error) {
          try {
            std::rethrow_exception(error);
          } catch (const std::exception& e) {
            send_json(response, {{"error", e.what()}}, 500);
          }
        });
    server.set_payload_max_length(kLongestRequest);
    server.set_tcp_nodelay(true);
    server.set_keep_alive_max_count(1'000'000);
  }

  void serve_page() {
    main.Get("/[0-9a-f]+/", [this](const httplib::Request&, httplib::Response& response) {
      if (!session.tabs().has_room())
        return refuse(response, 503,
                      fmt::format("{} tabs show this scene already, and more are not allowed. Close one and "
                                  "load this page again.",
                                  kMostTabs));
      serve_file("index.html", response);
    });
    main.Get("/[0-9a-f]+/page/([a-z_./0-9]+)",
             [this](const httplib::Request& request, httplib::Response& response) {
               serve_file(request.matches[1], response);
             });
  }

  void serve_file(const std::string& name, httplib::Response& response) {
    for (const PageFile& file : page_files())
      if (file.name == name) return response.set_content(file.bytes.data(), file.bytes.size(), type_of(name));
    refuse(response, 404, "There is no such file.");
  }

  void serve_api() {
    const auto get = [this](const std::string& what, std::function<Json()> answer) {
      main.Get("/[0-9a-f]+/api/" + what, [answer](const httplib::Request&, httplib::Response& response) {
        send_json(response, answer());
      });
    };
    get("state", [this] {
      Json json = session.state();
      // The port with the fewest tabs, because a browser allows at most six connections to each.
      json["stream"] = stream_ports[stream_tabs[0] <= stream_tabs[1] ? 0 : 1];
      return json;
    });
    get("figures", [this] { return session.figures(); });
    get("versions", [this] { return session.versions(); });
    get("presets", [] { return presets_list(); });
    main.Get("/[0-9a-f]+/api/schema", [](const httplib::Request&, httplib::Response& response) {
      response.set_content(producer::scene_schema(), "application/json");
    });
    main.Get("/[0-9a-f]+/api/version/([0-9]{1,18})",
             [this](const httplib::Request& request, httplib::Response& response) {
               send_json(response, {{"text", session.version_text(std::stoull(request.matches[1]))}});
             });
    main.Post("/[0-9a-f]+/api/([a-z]+)",
              [this](const httplib::Request& request, httplib::Response& response) {
                const auto body = nlohmann::json::parse(request.body, nullptr, false);
                if (!body.is_object())
                  return send_json(response, {{"error", "the request is not a JSON object"}}, 400);
                const Reply reply = session.post(request.matches[1], body, request.get_header_value("X-Tab"));
                send_json(response, reply.body, reply.status);
              });
  }

  void serve_pictures() {
    main.Get("/[0-9a-f]+/frame/([0-9a-f]+)/([0-9]{1,7})", [this](const httplib::Request& request,
                                                                 httplib::Response& response) {
      const auto picture = session.engine().frame(request.matches[1], std::stoi(request.matches[2]),
                                                  detail_of(request.get_param_value("d")));
      if (!picture) return refuse(response, 404, "This frame is not in memory.");
      const render::Camera& c = picture->camera;
      response.set_header("X-Camera", fmt::format("{} {} {} {} {} {} {}", c.eye.x(), c.eye.y(), c.eye.z(),
                                                  c.target.x(), c.target.y(), c.target.z(), c.fov_deg));
      send_picture(*picture->jpeg, response);
    });
    main.Get("/[0-9a-f]+/thumb/([0-9a-f]+)",
             [this](const httplib::Request& request, httplib::Response& response) {
               const std::string film = request.matches[1];
               const auto ranges = session.engine().ranges(film);
               const auto picture =
                   ranges.empty() ? std::nullopt
                                  : session.engine().frame(film, ranges.back().second, engine::Detail::draft);
               if (!picture) return refuse(response, 404, "No frame of this version is in memory.");
               send_picture(*picture->jpeg, response);
             });
    main.Get("/[0-9a-f]+/cell/([0-9]{1,18})/([0-9]{1,4})",
             [this](const httplib::Request& request, httplib::Response& response) {
               const auto picture =
                   session.engine().cell(std::stoull(request.matches[1]), std::stoi(request.matches[2]));
               if (!picture) return refuse(response, 404, "This picture is not ready.");
               send_picture(*picture, response);
             });
  }

  static void send_picture(const std::string& jpeg, httplib::Response& response) {
    response.set_content(jpeg, "image/jpeg");
  }

  /// Server-sent events: the latest message of each kind, and a heartbeat that detects closed tabs.
  void serve_stream(httplib::Server& server, std::atomic<int>& open) {
    server.Get(
        "/[0-9a-f]+/stream", [this, &open](const httplib::Request& request, httplib::Response& response) {
          const std::string tab = request.get_param_value("tab").substr(0, 64);
          response.set_header("Access-Control-Allow-Origin",
                              request.has_header("Origin") ? request.get_header_value("Origin") : origin());
          if (tab.empty() || tab.find_first_not_of("0123456789abcdef") != std::string::npos)
            return refuse(response, 400, "A stream needs the name of its tab.");
          const auto ticket = session.tabs().open(tab);
          if (!ticket) return refuse(response, 503, fmt::format("{} tabs are open already.", kMostTabs));
          ++open;
          auto begun = std::make_shared<bool>(false);
          response.set_chunked_content_provider(
              "text/event-stream",
              [this, tab, ticket, begun](std::size_t, httplib::DataSink& sink) {
                if (!*begun) {
                  *begun = true;
                  const std::string hello = "retry: 500\nevent: hello\ndata: {}\n\n";
                  return sink.write(hello.data(), hello.size());
                }
                const Tabs::Next next = session.tabs().wait(tab, *ticket, kHeartbeat);
                if (next.over) {
                  sink.done();
                  return true;
                }
                std::string text = ": still here\n\n";
                if (next.message)
                  text = "event: " + next.message->kind.substr(0, next.message->kind.find(':')) +
                         "\ndata: " + next.message->json + "\n\n";
                return sink.write(text.data(), text.size());
              },
              [this, tab, ticket, &open](bool) {
                --open;
                session.tabs().close(tab, *ticket);
              });
        });
  }

  void bind(httplib::Server& server, int& bound, int wanted, std::size_t pool) {
    server.new_task_queue = [pool] { return new httplib::ThreadPool(pool); };
    if (wanted > 0) {
      if (!server.bind_to_port(kHost, wanted))
        throw std::runtime_error(fmt::format(
            "port {} of {} is in use or not permitted; choose another with --port", wanted, kHost));
      bound = wanted;
      return;
    }
    bound = server.bind_to_any_port(kHost);
    if (bound <= 0) throw std::runtime_error("no port of 127.0.0.1 can be used");
  }
};

HttpServer::HttpServer(Session& session, int port) : impl_(std::make_unique<Impl>(session)) {
  Impl& impl = *impl_;
  impl.bind(impl.main, impl.port, port, kThreads);
  for (int i = 0; i < kStreamServers; ++i)
    impl.bind(impl.streams[i], impl.stream_ports[i], 0, kStreamThreads);
  impl.guard(impl.main, impl.port);
  impl.serve_page();
  impl.serve_api();
  impl.serve_pictures();
  for (int i = 0; i < kStreamServers; ++i) {
    impl.guard(impl.streams[i], impl.stream_ports[i]);
    impl.serve_stream(impl.streams[i], impl.stream_tabs[i]);
  }
  const auto listen = [&impl](httplib::Server& server) {
    impl.threads.emplace_back([&server] { server.listen_after_bind(); });
  };
  listen(impl.main);
  for (httplib::Server& server : impl.streams) listen(server);
}

HttpServer::~HttpServer() {
  impl_->session.close();
  const auto stop = [](httplib::Server& server) {
    // stop() has no effect while the server is starting.
    while (!server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    server.stop();
  };
  stop(impl_->main);
  for (httplib::Server& server : impl_->streams) stop(server);
  for (std::thread& thread : impl_->threads) thread.join();
}

std::string HttpServer::address() const {
  return impl_->origin() + "/" + impl_->token + "/";
}

}  // namespace offstage::tune
