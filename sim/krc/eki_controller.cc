#include "sim/krc/eki_controller.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sim/krc/eki_machine.h"

namespace cellcal::sim {

using drivers::Duration;
using drivers::TimePoint;

EkiController::EkiController(EkiControllerConfig config)
    : impl_(std::make_unique<EkiMachine>(std::move(config))) {}
EkiController::~EkiController() = default;

void EkiController::tick(TimePoint now) {
  impl_->tick(now, {muted_, deaf_, forgetful_, submit_halted_});
}
Duration EkiController::cycle() const { return std::chrono::milliseconds(impl_->config.cycle_ms); }

void EkiController::input_broken(bool broken, TimePoint t) {
  const bool closed = input_closed_;
  input_broken_ = false;
  if (!impl_->wiring.contact_is_on) input(t, broken || closed);
  input_broken_ = broken;
  input_closed_ = closed;
}

void EkiController::input(TimePoint t, bool closed) {
  input_closed_ = closed;
  if (input_broken_) return;
  // Delay of the filter, and until the next sample.
  const double since_epoch = std::chrono::duration<double>(t.time_since_epoch()).count();
  const double filtered = since_epoch + impl_->config.input_delay_s;
  const double sample = impl_->config.input_sample_s;
  const double seen = sample > 0.0 ? std::ceil(filtered / sample) * sample : filtered;
  impl_->edges.emplace_back(t + drivers::from_seconds(seen - since_epoch), closed);
}

bool EkiController::connect() { return impl_->channel.connect(); }
void EkiController::disconnect() { impl_->channel.disconnect(); }
bool EkiController::connected() const { return impl_->channel.connected(); }
void EkiController::receive(std::string_view bytes) { impl_->channel.receive(bytes); }
std::string EkiController::drain_output() { return impl_->channel.drain_output(); }

void EkiController::start_program() {
  const bool under_cell =
      impl_->selected == "CELL" && impl_->state != EkiMachine::ProgramState::kFree;
  impl_->start(under_cell ? "CELL" : "CELLCAL_EKI");
}
void EkiController::start_other_program() { impl_->start("OTHER"); }

void EkiController::call_program() {
  impl_->start("CELL");
  impl_->system("CELL_CALLS").set_whole(1);
}
bool EkiController::program_runs() const {
  return impl_->state == EkiMachine::ProgramState::kActive &&
         (impl_->robot.is_in("CELLCAL_EKI") || impl_->system("CELL_CALLS").truth());
}
std::string EkiController::fault() const {
  return impl_->robot.message() + impl_->submit.message();
}
void EkiController::request(drivers::ControllerRequest request) { impl_->request = request; }

void EkiController::cancel_program() {
  impl_->cancelling = true;
  impl_->stop_program();
  impl_->cancel();
}

void EkiController::emergency_stop(bool pressed) {
  impl_->e_stop = pressed;
  if (!pressed) return;
  impl_->stop_message = true;
  impl_->stop_program();
}

void EkiController::drives(bool on) {
  impl_->drives_on = on;
  if (!on) impl_->stop_program();
}

void EkiController::mode(drivers::OperatingMode mode) {
  // Turning the key switch stops and cancels any program.
  if (mode != impl_->mode) cancel_program();
  impl_->mode = mode;
}

void EkiController::start_key(bool held) { impl_->start_held = held; }
void EkiController::set_override(int percent) {
  impl_->override_percent = std::clamp(percent, 0, 100);
}

void EkiController::creep(std::size_t axis, double per_s) { impl_->arm.creep(axis, per_s); }

void EkiController::place(const std::vector<double>& pose_rad) {
  if (!impl_->arm.at_rest() || pose_rad.size() != impl_->axes) {
    throw std::invalid_argument("emulated EKI controller: place() at rest, one angle per axis");
  }
  impl_->arm.place(pose_rad);
}

void EkiController::reconfigure_io() { impl_->channel.remove(); }

std::vector<double> EkiController::actual_rad_at(TimePoint t) const {
  return impl_->arm.actual_at(t);
}
std::vector<double> EkiController::setpoint_rad() const { return impl_->arm.setpoint(); }
bool EkiController::moving() const { return !impl_->arm.at_rest(); }
bool EkiController::ready() const { return impl_->asked("CC_IS_READY") != 0; }
std::uint32_t EkiController::session() const { return static_cast<std::uint32_t>(impl_->system("CC_SESSION").i);
}
std::uint64_t EkiController::moves() const { return impl_->moves; }
drivers::EkiFrameValues EkiController::frame(drivers::EkiFrameKind kind, int number) const {
  const bool tool = kind == drivers::EkiFrameKind::kTool;
  const auto& parts = impl_->system(tool ? "TOOL_DATA" : "BASE_DATA")
                          .parts.at(static_cast<std::size_t>(number) - 1)
                          .parts;
  drivers::EkiFrameValues values{};
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = parts[i].r;
  return values;
}
std::uint64_t EkiController::frames_set() const { return impl_->frames_set; }
int EkiController::advice() const { return impl_->whole_or_0("CELLCAL_ADVICE"); }
int EkiController::advice_until() const { return impl_->whole_or_0("CELLCAL_ADVICE_UNTIL"); }
const EkiChannel& EkiController::channel() const { return impl_->channel; }

}  // namespace cellcal::sim
