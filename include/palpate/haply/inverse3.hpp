// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>
#include <palpate/haply/detail/link.hpp>
#include <palpate/haply/options.hpp>

#include <chrono>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

namespace palpate {

/// An Inverse3 of Haply, with a verse grip if there is one, through the vendor's service: JSON over a WebSocket, from a thread of its own.
///
///   Inverse3Device device({.device = "049D"});
///   DeviceSession const session(device);   // opens and arms
///
/// The servo's read and write exchange the newest state and the newest force with that thread; each of its messages carries one force and brings one
/// state, and the next goes when the last was answered. `read` says `stale` until a newer state has come; `state_age` is how old it may be.
/// Units      SI, as the service's. Frame: x to the right, y up, z towards the user (.axes); the origin is where the service has it.
/// Buttons    bits 0, 1, 2: a, b, c of a wireless grip; bit 0: the button of a wired one.
/// Errors     HaplyError from open and arm, in one line; faults later: the status of read and write, and pop_fault. A fault lasts until the device is
///            opened again. Nothing waits without end.
/// Threads    open, close, arm and disarm from one thread; read, write, state_age and pop_fault from one, not while this device is opened or closed;
///            counts from any between the two.
/// Cost       read and write: wait-free, noexcept, no allocation. The thread parses some 2 kB for each message.
/// Source     \cite haply_service
/// Limits     written to the published protocol and tested against a stand-in for the service; it has met no real device yet. No torques.
class Inverse3Device {
  using Clock = std::chrono::steady_clock;
  using Link = detail::haply::Link;

 public:
  explicit Inverse3Device(Inverse3Options options = {}) : options_(std::move(options)) {
    options_.validate();
    capabilities_ = unopened();
    require_valid(capabilities_);
  }

  Inverse3Device(Inverse3Device&&) = default;
  Inverse3Device& operator=(Inverse3Device&&) = delete;
  ~Inverse3Device() { close(); }

  /// Connects, chooses the device and asks it for one state, with no force.
  void open() {
    if (is_open()) throw InvalidArgument("Inverse3Device: it is open already; close it first");
    auto link = connected();
    Inverse3Report const& report = link->report();
    Capabilities found = unopened();
    found.reports_orientation = !report.grip_id.empty();
    found.buttons = report.grip_id.empty() ? 0 : report.wireless_grip ? 3 : 1;
    if (!found.workspace.known() && report.mount.is_identity() && report.workspace.is_identity()) found.workspace = guessed_workspace();
    link_ = std::move(link);
    capabilities_ = found;
    told_ = false;
    is_open_ = true;
  }
  /// The last force that the service is sent is zero.
  void close() noexcept {
    if (!is_open()) return;
    is_open_ = false;
    link_->force_wanted.store(false);
    link_->stop();
  }

  /// From now on forces are sent; they rise to what is written within options.ramp.
  void arm() {
    if (!is_open()) throw InvalidArgument("Inverse3Device: arm() needs an open device; call open() first, or use a DeviceSession");
    if (auto const ending = link_->ended.load(); ending != HaplyProblem::none)
      throw HaplyError(ending, std::string("no force: ") + link_->words() + "; close the device and open it again");
    if (link_->report().power_supply == false)
      throw HaplyError(HaplyProblem::no_power,
                       "the service says that the device has no power supply: its motors stay off; plug it in, and open the device again");
    link_->armed_at.store(Clock::now().time_since_epoch().count());
    link_->force_wanted.store(true);
  }
  /// Returns when zero was sent, after a tenth of a second at most.
  void disarm() noexcept {
    if (!is_open()) return;
    link_->force_wanted.store(false);
    auto const until = Clock::now() + std::chrono::milliseconds(100);
    auto const seen = link_->exchanges.load();
    while (Clock::now() < until && link_->ended.load() == HaplyProblem::none && !(link_->quiet.load() && link_->exchanges.load() >= seen + 2))
      std::this_thread::sleep_for(std::chrono::microseconds(200));
  }

  DeviceStatus read(DeviceState<double>& state) noexcept {
    if (!is_open()) return DeviceStatus::disconnected;
    if (auto const ending = link_->ended.load(); ending != HaplyProblem::none) return detail::haply::status_of(ending);
    bool const fresh = link_->samples.fetch();
    if (state_age() > options_.stall) {
      link_->end(HaplyProblem::silent);
      return detail::haply::status_of(link_->ended.load());
    }
    state = fill(link_->samples.front().state, state);
    return fresh ? DeviceStatus::ok : DeviceStatus::stale;
  }

  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    if (!is_open()) return DeviceStatus::disconnected;
    if (auto const ending = link_->ended.load(); ending != HaplyProblem::none) return detail::haply::status_of(ending);
    link_->commands.write({.force = wrench.force, .written = Clock::now()});
    return DeviceStatus::ok;
  }

  /// Seconds since the state of the last `read` was asked for: it is no older. Infinite while the device is closed.
  double state_age() const noexcept {
    if (!is_open()) return std::numeric_limits<double>::infinity();
    return std::chrono::duration<double>(Clock::now() - link_->samples.front().asked).count();
  }

  /// What ended the session, once; its number is that of `HaplyProblem`. The text is valid until the device is opened again.
  std::optional<DeviceFault> pop_fault() noexcept {
    if (!link_ || told_) return std::nullopt;
    auto const ending = link_->ended.load();
    if (ending == HaplyProblem::none) return std::nullopt;
    told_ = true;
    return DeviceFault{.status = detail::haply::status_of(ending), .native_code = static_cast<int>(ending), .what = link_->words()};
  }

  Capabilities capabilities() const { return capabilities_; }
  DeviceDescription description() const {
    Inverse3Report const& said = report();
    return {.vendor = "Haply Robotics",
            .model = said.type.empty() ? "inverse3" : said.type,
            .serial = said.device_id,
            .driver = said.service_version.empty() ? "Inverse Service" : "Inverse Service " + said.service_version};
  }
  /// What the service said when the device was last opened: its version, axes, mount, grip.
  Inverse3Report report() const { return link_ ? link_->report() : Inverse3Report{}; }

  Inverse3Counts counts() const noexcept {
    if (!link_) return {};
    return {.exchanges = link_->exchanges, .unattended = link_->unattended, .jumps = link_->jumps, .gaps = link_->gaps};
  }

 private:
  bool is_open() const noexcept { return link_ && is_open_; }

  Capabilities unopened() const {
    return {.max_force = options_.max_force, .rate = guessed(options_.rate), .reports_velocity = true, .workspace = options_.workspace};
  }
  std::unique_ptr<Link> connected() const {
    try {
      auto link = std::make_unique<Link>(options_);
      link->start();
      return link;
    } catch (Error const&) {
      throw;
    } catch (std::exception const& error) {   // the system has no socket or thread left
      throw HaplyError(HaplyProblem::not_reachable, error.what());
    }
  }

  /// What the service gives: an orientation only with a grip, and never an angular velocity.
  DeviceState<double> fill(DeviceState<double> const& from, DeviceState<double> const& before) const noexcept {
    DeviceState<double> state = from;
    if (!capabilities_.reports_orientation) state.orientation = before.orientation;
    state.angular_velocity = before.angular_velocity;
    return state;
  }

  /// Around the poses that the vendor's pages show, in the frame here for the usual axes; the maker has published no numbers.
  DeviceWorkspace guessed_workspace() const {
    HaplyFrame const to_here(*signed_axes(options_.axes), Matrix<double, 3, 3>::Identity());
    Vector3<double> const a = to_here.from_service(Vector3<double>(-0.10, -0.22, 0.05)), b = to_here.from_service(Vector3<double>(0.10, -0.06, 0.25));
    return {.lower = a.cwiseMin(b), .upper = a.cwiseMax(b), .provenance = Provenance::guessed};
  }

  Inverse3Options options_;
  Capabilities capabilities_;
  std::unique_ptr<Link> link_;   // of the last opening: its report, counts and fault can be asked for afterwards
  bool is_open_ = false, told_ = false;
};

static_assert(HapticDevice<Inverse3Device> && OpensAndCloses<Inverse3Device> && Armable<Inverse3Device> && DescribesItself<Inverse3Device>);
static_assert(ReportsFaults<Inverse3Device> && !SelfClocked<Inverse3Device>);

}  // namespace palpate
