// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace palpate_test {

/// A state as the service writes it, of device 049D and a wireless grip; what is given is the text of each part.
struct StateText {
  std::string device = "049D";
  std::string position = R"({"x":0.05,"y":-0.12,"z":0.15})";
  std::string velocity = R"({"x":0.1,"y":0.2,"z":-0.3})";
  std::string transform{};   // empty: not sent
  std::string orientation = R"({"w":1.0,"x":0.0,"y":0.0,"z":0.0})";
  std::string buttons = R"({"a":false,"b":false,"c":false})";
  bool grip = true;

  std::string text() const {
    std::string result =
        R"({"inverse3":[{"device_id":")" + device + R"(","state":{"cursor_position":)" + position + R"(,"cursor_velocity":)" + velocity;
    result += R"(,"body_orientation":{"w":1.0,"x":0.0,"y":0.0,"z":0.0},"current_cursor_force":{"x":0.0,"y":0.0,"z":0.0},"control_mode":"force")";
    if (!transform.empty()) result += R"(,"transform":)" + transform;
    result += R"(},"status":{"calibrated":true,"in_use":true,"power_supply":true,"ready":true,"started":true}}])";
    if (grip)
      result += R"(,"wireless_verse_grip":[{"device_id":"61548","state":{"orientation":)" + orientation + R"(,"buttons":)" + buttons +
                R"(,"hall":12,"battery_level":0.8},"status":{"connected":true}}])";
    return result + "}";
  }
};

/// The inventory before it; the text of single parts can be replaced.
struct InventoryText {
  std::string devices{};   // empty: one, from the parts below
  std::string device = "049D";
  std::string basis = R"("basis":{"permutation":"XYZ"},)";
  std::string mount = R"("mount":{"position":{"x":0,"y":0,"z":0},"rotation":{"w":1,"x":0,"y":0,"z":0},"scale":{"x":1,"y":1,"z":1}},)";
  std::string transform = R"(,"transform":{"position":{"x":0,"y":0,"z":0},"rotation":{"w":1,"x":0,"y":0,"z":0},"scale":{"x":1,"y":1,"z":1}})";
  std::string power = "true";
  std::string grips =
      R"(,"wireless_verse_grip":[{"device_id":"61548","config":{"type":"wireless_verse_grip","port":"COM3"},"state":{"orientation":)"
      R"({"w":1.0,"x":0.0,"y":0.0,"z":0.0},"buttons":{"a":false,"b":false,"c":false},"battery_level":0.8},"status":{"connected":true}}])";

  std::string one() const {
    return R"({"device_id":")" + device +
           R"(","config":{"type":"inverse3","port":"COM12","device_info":{"major_version":7,"minor_version":4,"id":")" + device +
           R"("},"gravity_compensation":{"enabled":true,"scaling_factor":1.0},"handedness":"right","preset":"defaults",)" + basis + mount +
           R"("filters":{"force_gate":{"gain":0.3}}},"state":{"cursor_position":{"x":0.05,"y":-0.12,"z":0.15},"cursor_velocity":{"x":0,"y":0,"z":0},)" +
           R"("angular_position":{"a0":-69.3,"a1":137.6,"a2":19.8},"control_mode":"idle")" + transform +
           R"(},"status":{"calibrated":true,"in_use":false,"power_supply":)" + power + R"(,"ready":true,"started":true}})";
  }
  std::string text() const { return R"({"session_id":7,"inverse3":[)" + (devices.empty() ? one() : devices) + "]" + grips + "}"; }
};

/// One message of the client's.
struct MockMessage {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  bool early = false;   // it came before the one before it was answered
  std::string device{};
};

struct MockPlan {
  std::string version = "3.5.0";   // empty: GET /version is 404
  std::string dialect = "vector";
  std::string inventory = InventoryText{}.text();
  std::function<std::string(int)> answer = [](int) { return StateText{}.text(); };   // to the n-th message of a connection, from 1
  std::function<int(int)> late = [](int) { return 0; };      // ms by which the n-th answer is late
  std::function<int(int)> times = [](int) { return 1; };      // that the n-th answer is sent
  std::function<bool(int)> cut = [](int) { return false; };   // is the connection cut instead of the n-th answer?
  bool refuses = false;   // no WebSocket here
  bool mute = false;   // takes connections and says nothing
  std::size_t piece = 0;   // bytes a frame; 0: messages are sent in one
};

/// A stand-in for Haply's service, on a port of its own of 127.0.0.1 and in threads of its own, one a connection. Stricter than the
/// real one: it knows set_cursor_force in one dialect and nothing else, and writes down what else comes.
class MockService {
 public:
  explicit MockService(MockPlan plan = {});
  ~MockService();
  MockService(MockService const&) = delete;
  MockService& operator=(MockService const&) = delete;

  int port() const;
  std::vector<MockMessage> messages() const;   // of all connections
  std::vector<std::string> violations() const;
  int goodbyes() const;   // connections that ended as the protocol says

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

/// Waits until that holds; false when it does not in ten seconds.
template <class Holds>
bool comes_true(Holds holds) {
  auto const until = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  return true;
}

}  // namespace palpate_test
