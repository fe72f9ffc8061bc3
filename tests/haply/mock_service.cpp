// SPDX-License-Identifier: MIT
#include "haply/mock_service.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket.hpp>
#include <nlohmann/json.hpp>

#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <set>
#include <utility>

namespace palpate_test {

namespace beast = boost::beast;
using Tcp = boost::asio::ip::tcp;
using ErrorCode = boost::system::error_code;
using WebSocket = beast::websocket::stream<Tcp::socket, false>;

struct MockService::Inside {
  explicit Inside(MockPlan its) : plan(std::move(its)), acceptor(io, Tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0)) {
    port = acceptor.local_endpoint().port();
    thread = std::thread([this] { run(); });
  }
  ~Inside() {
    stopping.store(true);
    ::shutdown(acceptor.native_handle(), SHUT_RDWR);   // wakes accept
    {
      std::lock_guard const lock(mutex);
      for (int const each : connected) ::shutdown(each, SHUT_RDWR);
    }
    thread.join();
    for (std::thread& each : connections) each.join();
  }

  void run() {
    while (!stopping.load()) {
      ErrorCode error;
      Tcp::socket socket(io);
      acceptor.accept(socket, error);
      if (error) return;
      socket.set_option(Tcp::no_delay(true), error);
      {
        std::lock_guard const lock(mutex);
        connected.insert(socket.native_handle());
        if (stopping.load()) return;
      }
      connections.emplace_back([this, its = std::move(socket)]() mutable { serve(its); });
    }
  }

  /// The handle is forgotten before it is closed.
  void forget(int handle) {
    std::lock_guard const lock(mutex);
    connected.erase(handle);
  }

  void serve(Tcp::socket& socket) {
    namespace http = beast::http;
    struct Forgets {
      Inside& inside;
      int handle;
      ~Forgets() { inside.forget(handle); }
    };
    int const handle = socket.native_handle();
    ErrorCode error;
    beast::flat_buffer buffer;
    http::request<http::string_body> request;
    http::read(socket, buffer, request, error);
    if (error || plan.mute) {
      char byte = 0;
      while (!error) socket.read_some(boost::asio::buffer(&byte, 1), error);   // until the client leaves
      forget(handle);
      return;
    }
    bool const upgrade = beast::websocket::is_upgrade(request);
    if (!upgrade || plan.refuses) {
      bool const knows = !upgrade && request.target() == "/version" && !plan.version.empty();
      http::response<http::string_body> response(knows ? http::status::ok : upgrade ? http::status::forbidden : http::status::not_found, 11);
      if (knows) response.body() = R"({"git_describe":"x","git_tag":")" + plan.version + R"(","project_version":")" + plan.version + R"(.0"})";
      response.prepare_payload();
      http::write(socket, response, error);
      forget(handle);
      return;
    }
    WebSocket web(std::move(socket));
    Forgets const forgets{*this, handle};   // before `web` is
    web.accept(request, error);
    if (!error) talk(web);
  }

  void talk(WebSocket& web) {
    ErrorCode error;
    say(web, plan.inventory, error);
    bool early = false;
    for (int n = 1; !error; ++n) {
      beast::flat_buffer buffer;
      web.read(buffer, error);
      if (error == beast::websocket::error::closed) {
        std::lock_guard const lock(mutex);
        ++goodbyes;
      }
      if (error) return;
      hear(beast::buffers_to_string(buffer.data()), early, web.got_text());
      if (plan.cut(n)) return;
      for (int ms = plan.late(n); ms > 0 && !stopping.load(); --ms) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      std::string const answer = plan.answer(n);
      early = web.next_layer().available(error) > 0;
      for (int times = plan.times(n); times > 0; --times) say(web, answer, error);
    }
  }

  void say(WebSocket& web, std::string const& text, ErrorCode& error) {
    if (error) return;
    web.text(true);
    std::size_t const piece = plan.piece == 0 ? text.size() : plan.piece;
    for (std::size_t at = 0; at < text.size() && !error; at += piece)
      web.write_some(at + piece >= text.size(), boost::asio::buffer(text.data() + at, std::min(piece, text.size() - at)), error);
  }

  void hear(std::string const& text, bool early, bool is_text) {
    std::lock_guard const lock(mutex);
    MockMessage message{.early = early};
    try {
      auto const document = nlohmann::json::parse(text);
      auto const& device = document.at("inverse3").at(0);
      auto const& force = device.at("commands").at("set_cursor_force").at(plan.dialect);
      message.force = {force.at("x").get<double>(), force.at("y").get<double>(), force.at("z").get<double>()};
      message.device = device.at("device_id").get<std::string>();
      bool const plain = document.size() == 1 && document.at("inverse3").size() == 1 && device.size() == 2 && device.at("commands").size() == 1 &&
                         device.at("commands").at("set_cursor_force").size() == 1 && force.size() == 3 && device.at("device_id").is_string();
      if (!plain || !is_text || !message.force.allFinite()) violations.push_back("not what it should be: " + text);
    } catch (nlohmann::json::exception const& wrong) {
      violations.push_back(std::string(wrong.what()) + ": " + text);
    }
    messages.push_back(message);
  }

  MockPlan const plan;
  boost::asio::io_context io;
  Tcp::acceptor acceptor;
  int port = 0;
  std::mutex mutable mutex;
  std::vector<MockMessage> messages;
  std::vector<std::string> violations;
  int goodbyes = 0;
  std::set<int> connected;
  std::atomic<bool> stopping{false};
  std::vector<std::thread> connections;   // of the thread that accepts, until that has ended
  std::thread thread;
};

MockService::MockService(MockPlan plan) : inside_(std::make_unique<Inside>(std::move(plan))) {}
MockService::~MockService() = default;

int MockService::port() const { return inside_->port; }
std::vector<MockMessage> MockService::messages() const {
  std::lock_guard const lock(inside_->mutex);
  return inside_->messages;
}
std::vector<std::string> MockService::violations() const {
  std::lock_guard const lock(inside_->mutex);
  return inside_->violations;
}
int MockService::goodbyes() const {
  std::lock_guard const lock(inside_->mutex);
  return inside_->goodbyes;
}

}  // namespace palpate_test
