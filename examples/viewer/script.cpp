// SPDX-License-Identifier: MIT
#include "script.hpp"

#include "report.hpp"

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>

#include <vtkCommand.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <thread>

namespace viewer {

namespace {

constexpr double frame = 0.016;   // s; so many whole ticks of the servo
constexpr char const* button_names[] = {"record", "replay", "undo", "reset"};   // as in all_buttons

/// The mouse and the keyboard.
class Player {
 public:
  Player(Engine& engine, Window& window, bool realtime) : engine_(engine), window_(window), realtime_(realtime) {}

  void wait(double seconds) {
    pass(seconds, [](double) {});
  }
  void move(double x, double y, double seconds) {
    double const from_x = x_, from_y = y_;
    auto const go = [&](double share) {
      x_ = from_x + share * (x - from_x);
      y_ = from_y + share * (y - from_y);
      send(vtkCommand::MouseMoveEvent);
    };
    if (seconds > 0.0) pass(seconds, go);
    else go(1.0);
  }
  void send(unsigned long event, char const* key = nullptr) {
    vtkRenderWindowInteractor* const interactor = window_.interactor();
    int const x = static_cast<int>(std::lround(x_)), y = static_cast<int>(std::lround(y_));
    interactor->SetEventInformationFlipY(x, y, 0, 0, key != nullptr ? *key : '\0', 0, key);
    interactor->InvokeEvent(event);
  }

 private:
  /// Lets time go by, and does something with each share of it, from above 0 to 1.
  template <class Do>
  void pass(double seconds, Do const& act) {
    if (realtime_) return pass_by_the_clock(seconds, act);
    int const frames = std::max(1, static_cast<int>(std::lround(seconds / frame)));
    for (int k = 1; k <= frames; ++k) {
      act(static_cast<double>(k) / frames);
      engine_.advance(frame);
      window_.update();
    }
  }
  template <class Do>
  void pass_by_the_clock(double seconds, Do const& act) {
    auto const begin = PictureClock::Clock::now();
    for (double share = 0.0; share < 1.0;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(4));   // some mice speak up 250 times a second
      auto const now = PictureClock::Clock::now();
      share = std::min(1.0, std::chrono::duration<double>(now - begin).count() / seconds);
      act(share);
      if (window_.pictures().is_due(now)) window_.draw();
      else window_.update();
    }
  }

  Engine& engine_;
  Window& window_;
  bool realtime_;
  double x_ = 0.0, y_ = 0.0;
};

}  // namespace

std::vector<Step> read_script(std::filesystem::path const& file) {
  std::istringstream text(palpate::detail::read_whole_file(file));
  std::vector<Step> script;
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    std::istringstream words(line.substr(0, line.find('#')));
    Step step;
    if (!(words >> step.verb)) continue;
    bool is_whole = false;
    if (step.verb == "move") {
      is_whole = static_cast<bool>(words >> step.x >> step.y);
      if (!(words >> step.seconds)) words.clear(), step.seconds = 0.0;
    } else if (step.verb == "wait") {
      is_whole = static_cast<bool>(words >> step.seconds);
    } else if (step.verb == "wheel") {
      is_whole = words >> step.x && std::abs(step.x) <= 1000;
    } else if (step.verb == "key" || step.verb == "shot") {
      is_whole = static_cast<bool>(words >> step.name);
    } else if (step.verb == "left" || step.verb == "right") {
      is_whole = words >> step.name && (step.name == "down" || step.name == "up");
    } else if (step.verb == "click") {
      is_whole = words >> step.name && std::find(std::begin(button_names), std::end(button_names), step.name) != std::end(button_names);
    }
    std::string rest;
    if (!is_whole || words >> rest || !(step.seconds >= 0.0 && step.seconds <= 600.0))
      throw palpate::FileError(palpate::detail::message(file.string(), ": line ", number, " is \"", line,
                                                        "\"; give move X Y [SECONDS], left or right down or up, wheel N (up to 1000), key NAME, "
                                                        "click record, replay, undo or reset, "
                                                        "wait SECONDS (up to 600), or shot NAME"));
    script.push_back(step);
  }
  return script;
}

void play(std::vector<Step> const& script, Engine& engine, Window& window, std::filesystem::path const& out, bool realtime) {
  Player player(engine, window, realtime);
  Report report;
  for (Step const& step : script) {
    if (step.verb == "move") player.move(step.x, step.y, step.seconds);
    if (step.verb == "wait") player.wait(step.seconds);
    if (step.verb == "key") player.send(vtkCommand::KeyPressEvent, step.name.c_str());
    if (step.verb == "left") player.send(step.name == "down" ? vtkCommand::LeftButtonPressEvent : vtkCommand::LeftButtonReleaseEvent);
    if (step.verb == "right") player.send(step.name == "down" ? vtkCommand::RightButtonPressEvent : vtkCommand::RightButtonReleaseEvent);
    for (int k = 0; step.verb == "wheel" && k < std::abs(step.x); ++k)
      player.send(step.x > 0 ? vtkCommand::MouseWheelForwardEvent : vtkCommand::MouseWheelBackwardEvent);
    if (step.verb == "click") {
      auto const k = std::find(std::begin(button_names), std::end(button_names), step.name) - std::begin(button_names);
      Box const& box = window.layout().buttons[static_cast<std::size_t>(k)];
      player.move(box.x + box.width / 2, window.layout().panel.height - 1.0 - (box.y + box.height / 2), 0.0);
      player.send(vtkCommand::LeftButtonPressEvent);
      player.send(vtkCommand::LeftButtonReleaseEvent);
    }
    if (step.verb == "shot") {
      window.write_picture(out / (step.name + ".png"));
      report.add(step.name, window);
    }
  }
  report.write(out / "report.txt");
}

}  // namespace viewer
