#pragma once
// The actual firmware image on a simulated ATmega328P, with the touch circuit around it, in virtual
// time. The simulator (libsimavr, GPL-3) is linked into these tests only.

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/contact/wire/ctp.h"
#include "drivers/contact/wire/ctp_codec.h"
#include "drivers/time.h"
#include "sim/mcu/microcontroller.h"

struct avr_t;
struct avr_irq_t;
struct avr_uart_t;

namespace cellcal::test {

using sim::TestPin;
using sim::TouchCircuit;

using drivers::Duration;
using drivers::TimePoint;

class SimavrBoard {
 public:
  /// Throws std::runtime_error if the image cannot be loaded. The baud rate is set by the straps.
  SimavrBoard(const std::string& elf, int baud, TimePoint power_on);
  ~SimavrBoard();
  SimavrBoard(const SimavrBoard&) = delete;
  SimavrBoard& operator=(const SimavrBoard&) = delete;

  /// Contact or release of the tip at t.
  void touch(TimePoint t, bool touching);
  /// Any other change of the circuit, now.
  void change(const TouchCircuit& circuit);
  const TouchCircuit& circuit() const { return circuit_; }
  /// The host starts sending these bytes at t, or when the line is free.
  void receive(std::span<const std::uint8_t> bytes, TimePoint t);
  void advance(TimePoint t);
  TimePoint now() const { return time_of(cycle()); }
  /// Presses the reset button.
  void reset();
  /// Halts the program with interrupts off: the watchdog must react.
  void hang();

  struct Bytes {
    TimePoint t{};  ///< when the last bit was on the wire
    std::vector<std::uint8_t> bytes;
  };
  /// The next complete block up to a 0x00.
  std::optional<Bytes> next_output();

  /// A frame sent by the board, for measurements.
  struct Sent {
    TimePoint t{};
    drivers::ctp::Frame frame;
  };
  std::vector<Sent> drain_sent();
  /// Changes of the pin, to the cycle, since the last call.
  struct PinEdge {
    std::uint64_t cycle = 0;
    bool high = false;
  };
  std::vector<PinEdge> drain_pin_edges();
  /// Likewise for D6, the output for a controller's input.
  std::vector<PinEdge> drain_output_edges();
  bool output_high() const { return output_high_; }

  TimePoint time_of(std::uint64_t cycle) const;
  std::uint64_t cycle() const;
  /// Bytes of memory between the program's variables and the deepest stack that were never used.
  std::size_t untouched_memory() const;

  static constexpr std::uint64_t kHz = 16'000'000;

 private:
  static void on_byte(avr_irq_t*, std::uint32_t value, void* board);
  static void on_reset(avr_t* avr);
  static void on_output(avr_irq_t*, std::uint32_t value, void* board);
  static void on_test_pin(avr_irq_t*, std::uint32_t value, void* board);
  std::uint64_t cycle_of(TimePoint t) const;
  void settle();
  void set_straps();
  void fill_memory();
  void run_action();
  /// Upper bound of the simulator's next step, asleep or awake.
  std::uint64_t next_stop() const;
  static std::uint64_t on_stop(avr_t*, std::uint64_t when, void* board);
  /// The program's setting of its UART, close to the baud rate.
  std::uint64_t own_byte_cycles() const;

  static constexpr std::uint64_t kNever = ~std::uint64_t{0};

  struct Action {
    enum Kind { kTouch, kByte } kind = kTouch;
    std::uint8_t value = 0;
  };

  avr_t* avr_ = nullptr;
  avr_uart_t* uart_ = nullptr;
  avr_irq_t *uart_in_ = nullptr, *pin_ = nullptr;
  avr_irq_t *adc_sense_ = nullptr, *adc_feed_ = nullptr, *adc_earth_ = nullptr;
  int baud_;
  TimePoint power_on_;
  TouchCircuit circuit_;
  bool output_high_ = false, pin_high_ = false, disturbed_ = false, was_reset_ = false;
  void (*core_reset_)(avr_t*) = nullptr;
  std::multimap<std::uint64_t, Action> actions_;
  std::uint64_t rx_free_ = 0, tx_free_ = 0, end_ = 0, stop_ = kNever;
  std::uint32_t stack_from_ = 0;
  Bytes current_;
  std::deque<Bytes> output_;
  drivers::ctp::FrameReader reader_{drivers::ctp::Direction::kFromSensor};
  std::vector<Sent> sent_;
  std::vector<PinEdge> pin_edges_, output_edges_;
};

/// The board as the line of drivers::ContactInline.
class SimavrLine : public drivers::ByteLine {
 public:
  explicit SimavrLine(SimavrBoard& board) : board_(board) {}

  void write(std::span<const std::uint8_t> bytes, TimePoint t) override {
    board_.receive(bytes, t);
  }
  /// The program's behaviour is unknown: polls often.
  TimePoint next() const override { return next_poll_; }
  void advance(TimePoint t) override {
    board_.advance(t);
    next_poll_ = t + kPollInterval;
  }
  std::size_t read(std::span<std::uint8_t> into, TimePoint& t) override;

 private:
  static constexpr std::chrono::microseconds kPollInterval{20};
  SimavrBoard& board_;
  TimePoint next_poll_{};
};

}  // namespace cellcal::test
