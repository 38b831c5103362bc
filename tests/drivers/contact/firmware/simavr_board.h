#pragma once
// The firmware's real image on a simulated ATmega328P, with the touch circuit around it, in virtual
// time. The simulator (libsimavr, GPL-3) is linked into these tests only.

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/contact/wire/byte_line.h"
#include "drivers/contact/wire/ctp.h"
#include "drivers/contact/wire/ctp_codec.h"
#include "drivers/time.h"
#include "sim/mcu/touch_circuit.h"

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

  /// The tip touches, or leaves, at t.
  void touch(TimePoint t, bool touching);
  /// Anything else about the circuit, now.
  void change(const TouchCircuit& circuit);
  const TouchCircuit& circuit() const { return circuit_; }
  /// The host begins to send these bytes at t, or when the line is free.
  void receive(std::span<const std::uint8_t> bytes, TimePoint t);
  void advance(TimePoint t);
  TimePoint now() const { return time_of(cycle()); }
  /// Presses the reset button.
  void reset();
  /// The program stops dead, with interrupts off: the watchdog must notice.
  void hang();

  struct Bytes {
    TimePoint t{};  ///< when the last bit was on the wire
    std::vector<std::uint8_t> bytes;
  };
  /// The next stretch up to a 0x00 that is complete.
  std::optional<Bytes> next_output();

  /// A frame that it sent, for whoever measures.
  struct Sent {
    TimePoint t{};
    drivers::ctp::Frame frame;
  };
  std::vector<Sent> take_sent();
  /// When the pin really changed, to the cycle, since the last call.
  struct PinEdge {
    std::uint64_t cycle = 0;
    bool high = false;
  };
  std::vector<PinEdge> take_pin_edges();
  /// The same of D6, the output for a controller's input.
  std::vector<PinEdge> take_output_edges();
  bool output_high() const { return output_high_; }

  TimePoint time_of(std::uint64_t cycle) const;
  std::uint64_t cycle() const;
  /// Bytes of memory, between the program's variables and the deepest stack, that were never used.
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
  /// Where the simulator must not jump over, asleep or awake.
  std::uint64_t next_stop() const;
  static std::uint64_t on_stop(avr_t*, std::uint64_t when, void* board);
  /// What the program has set its UART to, which is nearly the baud rate.
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

/// The board as the line that drivers::ContactInline runs on.
class SimavrLine : public drivers::ByteLine {
 public:
  explicit SimavrLine(SimavrBoard& board) : board_(board) {}

  void write(std::span<const std::uint8_t> bytes, TimePoint t) override {
    board_.receive(bytes, t);
  }
  /// Nobody knows what a program will do: look often.
  TimePoint next() const override { return next_look_; }
  void advance(TimePoint t) override {
    board_.advance(t);
    next_look_ = t + kLook;
  }
  std::size_t read(std::span<std::uint8_t> into, TimePoint& t) override;

 private:
  static constexpr std::chrono::microseconds kLook{20};
  SimavrBoard& board_;
  TimePoint next_look_{};
};

}  // namespace cellcal::test
