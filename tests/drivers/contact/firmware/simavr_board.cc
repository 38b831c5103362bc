#include "simavr_board.h"

#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <simavr/sim_regbit.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

/// The simulator frees little of its allocations.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libsimavr\n"; }

namespace cellcal::test {

namespace {

constexpr int kTestBit = 7, kOutputBit = 6, kStrap250k = 4, kStrap115k = 5;
constexpr std::uint32_t kSupplyMv = 5000;
constexpr std::uint8_t kUntouched = 0xA5;
constexpr std::uint64_t kWakeCycles = 800;  // a sleeping CPU jumps to its next timer: 50 us at most
// Addresses of the ATmega328P's data space.
constexpr std::uint16_t kPortD = 0x2B, kDdrD = 0x2A, kTifr1 = 0x36, kMcusr = 0x54, kUbrr0 = 0xC4;
constexpr avr_flashaddr_t kTrap = 0x7F00;  // beyond the program
constexpr std::uint8_t kExternalReset = 1 << 1;

std::uint64_t cycles_per_byte(int baud) {
  return SimavrBoard::kHz * CTP_BITS_PER_BYTE / static_cast<std::uint64_t>(baud);
}

/// Its UART has no other interface.
avr_uart_t* uart_of(avr_t* avr) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "uart") == 0) return reinterpret_cast<avr_uart_t*>(io);
  }
  throw std::runtime_error("libsimavr's atmega328p has no UART");
}

void no_sleep(avr_t*, avr_cycle_count_t) {}

/// simavr 1.6 clears every flag of a timer when any of them is written, so that an overflow gets
/// lost when the program clears the capture flag. The real one clears those that are written as 1.
void write_tifr1(avr_t* avr, avr_io_addr_t address, std::uint8_t value, void*) {
  for (int i = 0; i < avr->interrupts.vector_count; ++i) {
    avr_int_vector_t* vector = avr->interrupts.vector[i];
    if (vector->raised.reg != address || ((value >> vector->raised.bit) & 1) == 0) continue;
    avr_clear_interrupt(avr, vector);
    avr_regbit_clear(avr, vector->raised);
  }
}

void silent_log(avr_t*, const int, const char*, va_list) {}

avr_irq_t* irq_of(avr_t* avr, std::uint32_t request, int index) {
  return avr_io_getirq(avr, request, index);
}

}  // namespace

SimavrBoard::SimavrBoard(const std::string& elf, int baud, TimePoint power_on)
    : baud_(baud), power_on_(power_on) {
  avr_global_logger_set(silent_log);
  elf_firmware_t image{};
  if (elf_read_firmware(elf.c_str(), &image) != 0) throw std::runtime_error(elf + ": not readable");
  avr_ = avr_make_mcu_by_name("atmega328p");
  if (avr_ == nullptr) throw std::runtime_error("libsimavr knows no atmega328p");
  avr_init(avr_);
  avr_->frequency = static_cast<std::uint32_t>(kHz);
  avr_load_firmware(avr_, &image);
  avr_->vcc = avr_->avcc = avr_->aref = kSupplyMv;
  avr_->sleep = no_sleep;
  stack_from_ = static_cast<std::uint32_t>(0x100 + image.datasize + image.bsssize);
  uart_ = uart_of(avr_);
  uart_in_ = irq_of(avr_, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
  pin_ = irq_of(avr_, AVR_IOCTL_IOPORT_GETIRQ('B'), IOPORT_IRQ_PIN0);
  adc_sense_ = irq_of(avr_, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);
  adc_feed_ = irq_of(avr_, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC1);
  adc_earth_ = irq_of(avr_, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC2);
  std::uint32_t flags = 0;
  avr_ioctl(avr_, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  avr_irq_register_notify(irq_of(avr_, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_byte, this);
  for (const int index : {IOPORT_IRQ_DIRECTION_ALL, IOPORT_IRQ_REG_PORT}) {
    avr_irq_register_notify(irq_of(avr_, AVR_IOCTL_IOPORT_GETIRQ('D'), index), on_test_pin, this);
  }
  avr_irq_register_notify(irq_of(avr_, AVR_IOCTL_IOPORT_GETIRQ('D'), kOutputBit), on_output, this);
  avr_->custom.data = this;
  core_reset_ = avr_->reset;
  avr_->reset = on_reset;
  avr_->io[AVR_DATA_TO_IO(kTifr1)].w.c = write_tifr1;
  fill_memory();
  set_straps();
  settle();
}

SimavrBoard::~SimavrBoard() { avr_terminate(avr_); }

void SimavrBoard::set_straps() {
  // Connections to ground, stronger than the pins' pull-ups.
  avr_ioport_external_t straps{};
  straps.name = 'D';
  straps.mask = (1u << kStrap250k) | (1u << kStrap115k);
  straps.value = straps.mask;
  if (baud_ == 250'000) straps.value &= ~(1ul << kStrap250k);
  if (baud_ == 115'200) straps.value &= ~(1ul << kStrap115k);
  avr_ioctl(avr_, AVR_IOCTL_IOPORT_SET_EXTERNAL('D'), &straps);
}

void SimavrBoard::fill_memory() {
  std::memset(avr_->data + stack_from_, kUntouched, avr_->ramend + 1u - stack_from_);
}

std::size_t SimavrBoard::untouched_memory() const {
  std::size_t longest = 0, n = 0;  // the longest stretch: a variable may hold the pattern, too
  for (std::uint32_t at = stack_from_; at <= avr_->ramend; ++at) {
    n = avr_->data[at] == kUntouched ? n + 1 : 0;
    longest = std::max(longest, n);
  }
  return longest;
}

std::uint64_t SimavrBoard::cycle() const { return avr_->cycle; }

TimePoint SimavrBoard::time_of(std::uint64_t cycle) const {
  constexpr double kNsPerCycle = 1e9 / static_cast<double>(kHz);
  return power_on_ + std::chrono::nanoseconds{
                         static_cast<std::int64_t>(static_cast<double>(cycle) * kNsPerCycle)};
}

std::uint64_t SimavrBoard::cycle_of(TimePoint t) const {
  const double s = std::chrono::duration<double>(t - power_on_).count();
  return static_cast<std::uint64_t>(std::ceil(std::max(0.0, s) * static_cast<double>(kHz)));
}

// Inputs of the board
// -----------------------------------------------------------------------------

void SimavrBoard::settle() {
  const bool out = (avr_->data[kDdrD] & (1 << kTestBit)) != 0;
  const bool high = (avr_->data[kPortD] & (1 << kTestBit)) != 0;
  circuit_.test_pin = out ? (high ? TestPin::kHigh : TestPin::kLow)
                          : (high ? TestPin::kPullUp : TestPin::kReleased);
  const sim::CircuitVoltages volts = circuit_.voltages();
  const auto millivolts = [](double v) { return static_cast<std::uint32_t>(std::lround(v * 1e3)); };
  avr_raise_irq(adc_sense_, millivolts(volts.sense_v));
  avr_raise_irq(adc_feed_, millivolts(volts.feed_v));
  avr_raise_irq(adc_earth_, millivolts(volts.earth_v));
  const bool pin_high = circuit_.pin_high(pin_high_);
  if (pin_high != pin_high_) pin_edges_.push_back({avr_->cycle, pin_high});
  pin_high_ = pin_high;
  avr_raise_irq(pin_, pin_high ? 1 : 0);
}

void SimavrBoard::on_test_pin(avr_irq_t*, std::uint32_t, void* board) {
  // The register itself changes after this notification: read at the end of the instruction.
  static_cast<SimavrBoard*>(board)->disturbed_ = true;
}

void SimavrBoard::on_output(avr_irq_t*, std::uint32_t value, void* context) {
  auto& board = *static_cast<SimavrBoard*>(context);
  const bool high = value != 0;
  if (high != board.output_high_) board.output_edges_.push_back({board.avr_->cycle, high});
  board.output_high_ = high;
}

void SimavrBoard::touch(TimePoint t, bool touching) {
  actions_.emplace(cycle_of(t), Action{Action::kTouch, static_cast<std::uint8_t>(touching)});
}

void SimavrBoard::change(const TouchCircuit& circuit) {
  circuit_ = circuit;
  settle();
}

void SimavrBoard::receive(std::span<const std::uint8_t> bytes, TimePoint t) {
  rx_free_ = std::max({rx_free_, cycle_of(t), avr_->cycle});
  for (const std::uint8_t byte : bytes) {
    rx_free_ += cycles_per_byte(baud_);
    const std::uint64_t begins = rx_free_ - std::min(rx_free_, own_byte_cycles());
    actions_.emplace(std::max(begins, avr_->cycle), Action{Action::kByte, byte});
  }
}

std::uint64_t SimavrBoard::own_byte_cycles() const {
  constexpr std::uint64_t kClocksPerBit = 8;  // U2X0 is set
  const std::uint64_t divider = avr_->data[kUbrr0] | (avr_->data[kUbrr0 + 1] << 8);
  return (divider + 1) * kClocksPerBit * CTP_BITS_PER_BYTE;
}

std::uint64_t SimavrBoard::next_stop() const {
  std::uint64_t next = std::min(end_, avr_->cycle + kWakeCycles);
  if (!actions_.empty()) next = std::min(next, actions_.begin()->first);
  return std::max(next, avr_->cycle + 1);
}

std::uint64_t SimavrBoard::on_stop(avr_t*, std::uint64_t, void* context) {
  auto& board = *static_cast<SimavrBoard*>(context);
  return board.stop_ = board.next_stop();
}

void SimavrBoard::run_action() {
  const Action action = actions_.begin()->second;
  actions_.erase(actions_.begin());
  if (action.kind == Action::kByte) {
    avr_raise_irq(uart_in_, action.value);
  } else {
    circuit_.touching = action.value != 0;
    settle();
  }
}

void SimavrBoard::advance(TimePoint t) {
  const std::uint64_t end = end_ = cycle_of(t);
  // The simulator takes eleven bits for a byte.
  uart_->cycles_per_byte = own_byte_cycles();
  while (avr_->cycle < end) {
    while (!actions_.empty() && actions_.begin()->first <= avr_->cycle) run_action();
    if (next_stop() < stop_) {
      stop_ = next_stop();
      avr_cycle_timer_register(avr_, stop_ - avr_->cycle, on_stop, this);
      avr_->run_cycle_count = 1;  // otherwise it runs on to the timer that was next before
    }
    const int state = avr_run(avr_);
    if (state == cpu_Done || state == cpu_Crashed) throw std::runtime_error("the program crashed");
    if (was_reset_) {  // the outside is unchanged
      was_reset_ = false;
      stop_ = kNever;
      set_straps();
      disturbed_ = true;
    }
    if (disturbed_) {
      disturbed_ = false;
      settle();
    }
  }
}

void SimavrBoard::reset() {
  avr_reset(avr_);
  avr_->data[kMcusr] = kExternalReset;
}

void SimavrBoard::hang() {
  avr_->flash[kTrap] = 0xFF;  // rjmp .-2
  avr_->flash[kTrap + 1] = 0xCF;
  avr_->pc = kTrap;
  avr_->sreg[S_I] = 0;
  avr_->state = cpu_Running;
}

void SimavrBoard::on_reset(avr_t* avr) {
  auto& board = *static_cast<SimavrBoard*>(avr->custom.data);
  board.was_reset_ = true;
  if (board.core_reset_ != nullptr) board.core_reset_(avr);
}

// Outputs of the board
// -------------------------------------------------------------------------------

void SimavrBoard::on_byte(avr_irq_t*, std::uint32_t value, void* context) {
  auto& board = *static_cast<SimavrBoard*>(context);
  const auto byte = static_cast<std::uint8_t>(value);
  board.tx_free_ = std::max(board.tx_free_, board.avr_->cycle) + board.own_byte_cycles();
  board.current_.t = board.time_of(board.tx_free_);
  board.current_.bytes.push_back(byte);
  if (const drivers::ctp::Frame* frame = board.reader_.feed(byte)) {
    board.sent_.push_back({board.current_.t, *frame});
  }
  if (byte != 0) return;
  board.output_.push_back(std::move(board.current_));
  board.current_ = {};
}

std::optional<SimavrBoard::Bytes> SimavrBoard::next_output() {
  if (output_.empty() || output_.front().t > now()) return std::nullopt;
  Bytes bytes = std::move(output_.front());
  output_.pop_front();
  return bytes;
}

std::vector<SimavrBoard::Sent> SimavrBoard::drain_sent() { return std::exchange(sent_, {}); }

std::vector<SimavrBoard::PinEdge> SimavrBoard::drain_pin_edges() {
  return std::exchange(pin_edges_, {});
}

std::vector<SimavrBoard::PinEdge> SimavrBoard::drain_output_edges() {
  return std::exchange(output_edges_, {});
}

std::size_t SimavrLine::read(std::span<std::uint8_t> into, TimePoint& t) {
  const auto output = board_.next_output();
  if (!output) return 0;
  const std::size_t size = std::min(output->bytes.size(), into.size());
  std::copy_n(output->bytes.begin(), size, into.begin());
  t = output->t;
  return size;
}

}  // namespace cellcal::test
