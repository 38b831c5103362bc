#include "tests/bench/cell_session.h"

#include <numbers>

#include "tests/drivers/said.h"

namespace cellcal::bench {

using namespace drivers;  // NOLINT: a benchmark's own file
using std::chrono::milliseconds;

namespace {

constexpr milliseconds kArmLifetime{20'000};
constexpr milliseconds kNextPing{200};
constexpr int kArmTries = 4;

RsiConfig rsi_config(bool patient) {
  constexpr double kRad = std::numbers::pi / 180;
  RsiConfig config;
  config.bind_address = "127.0.0.1";
  config.port = 0;
  config.limits.assign(6, {-185 * kRad, 185 * kRad, 30 * kRad, 120 * kRad, 600 * kRad});
  config.correction_limit_deg.assign(6, 90.0);
  if (patient) {
    config.silence_cycles = 50;
    config.late_replies_limit = 1'000'000;
  }
  return config;
}

SerialContactOptions contact_options(const CellPeer& peer, const CellSessionOptions& options) {
  SerialContactOptions contact;
  contact.port = {peer.sensor_path(), CTP_DEFAULT_BAUD};
  if (!options.realtime) contact.port.priority = 0;
  if (options.patient) contact.contact.max_clock_sigma_s = 0.02;
  return contact;
}

}  // namespace

CellSession::CellSession(CellPeer& peer, const CellSessionOptions& options)
    : options_(options),
      peer_(peer),
      io_(IoThreadOptions{.realtime = options.realtime}),
      contact_(io_.context(), contact_options(peer, options)),
      robot_(io_.context(), rsi_config(options.patient), &contact_.guard()) {
  io_.start();
  contact_.open();
  robot_.open();
  peer_.start(robot_.port());
}

CellSession::~CellSession() {
  robot_.close();
  contact_.close();
  eventually([&] { return robot_.port() == 0; });
}

std::string CellSession::wait_until_ready() {
  if (!eventually([&] { return contact_.status().link == ContactLink::kReady; })) {
    return drivers::said(contact_.status().words);
  }
  const auto link = [&] { return robot_.state().link; };
  const bool ready = eventually([&] {
    if (link() == RobotLink::kNotReferenced) {
      robot_.rereference();
      std::this_thread::sleep_for(milliseconds{20});
    }
    return link() == RobotLink::kReady;
  });
  return ready ? std::string() : "not referenced: " + drivers::said(robot_.state().words);
}

std::optional<Silence> CellSession::lose_heartbeat() {
  const auto result = search_with([this] { peer_.fall_silent(); });
  if (!result) return std::nullopt;
  const std::optional<Silence> silence = peer_.consume_silence();
  peer_.release();
  if (result->outcome != MoveOutcome::kContactSilent) {
    return spoiled(std::string(to_string(result->outcome)) + ": " + drivers::said(result->detail));
  }
  return silence ? silence : spoiled("silence, but no frozen reply was seen");
}

std::optional<Contact> CellSession::search(std::optional<Duration> gap) {
  const auto result = search_with([&] { peer_.touch(gap); });
  if (!result) return std::nullopt;
  const std::optional<Contact> contact = peer_.consume_contact();
  peer_.release();
  eventually([&] { return contact_.status().in_contact == false; });
  if (result->outcome != MoveOutcome::kContact) {
    return spoiled(std::string(to_string(result->outcome)) + ": " + drivers::said(result->detail));
  }
  return contact ? contact : spoiled("contact, but no frozen reply was seen");
}

std::optional<MoveResult> CellSession::search_with(const std::function<void()>& what_happens) {
  const std::string trouble = wait_until_ready();
  if (!trouble.empty()) return spoiled(trouble);
  std::optional<ArmResult> armed;
  // Pings that a silent sensor did not answer are repeated after some time.
  for (int tries = 0; tries < kArmTries; ++tries) {
    if (tries > 0) std::this_thread::sleep_for(kNextPing);
    contact_.arm(++arm_id_, kArmLifetime);
    eventually([&] { return (armed = contact_.poll_arm()).has_value(); });
    if (!armed || armed->refusal != ArmRefusal::kClockNotSynchronised) break;
  }
  if (!armed || !armed->armed)
    return spoiled(armed ? drivers::said(armed->why_not) : "no answer to arm()");

  constexpr double kTravelRad = 0.01;  // longer than any search lasts
  forth_ = !forth_;
  Move move{++move_id_, MoveKind::kSearch, robot_.state().commanded_rad,
            kTravelRad / (1e-3 * options_.speed_mrad_s), arm_id_};
  move.target_rad[0] += forth_ ? kTravelRad : -kTravelRad;
  what_happens();
  robot_.begin(move);
  std::optional<MoveResult> result;
  eventually([&] { return (result = robot_.poll()).has_value(); });
  if (!result) {
    peer_.release();
    return spoiled("no result of the move");
  }
  return result;
}

std::nullopt_t CellSession::spoiled(const std::string& why) {
  ++spoilt_[why];
  return std::nullopt;
}

}  // namespace cellcal::bench
