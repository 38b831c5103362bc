#pragma once
// A W5500 by its data sheet, limited to one UDP socket: registers and buffers accessed by SPI
// frames, commands, and the network.

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "drivers/contact/firmware/w5500/w5500.h"

namespace cellcal::test {

using Datagram = std::pair<w5500_peer, std::vector<std::uint8_t>>;

class W5500Model {
 public:
  W5500Model() { forget(); }

  w5500_bus bus() {
    return {
        [](void* self, bool on) { static_cast<W5500Model*>(self)->select(on); },
        [](void* self, std::uint8_t out) { return static_cast<W5500Model*>(self)->exchange(out); },
        this};
  }

  /// A datagram arrives; false: no room, it is lost.
  bool arrive(const w5500_peer& from, const std::vector<std::uint8_t>& bytes) {
    if (at(kSocket, 0x03) != 0x22) return false;
    if (kBuffer - waiting() < bytes.size() + 8) return false;
    std::vector<std::uint8_t> whole(from.address, from.address + 4);
    for (const std::size_t word : {std::size_t{from.port}, bytes.size()}) {
      whole.push_back(static_cast<std::uint8_t>(word >> 8));
      whole.push_back(static_cast<std::uint8_t>(word));
    }
    whole.insert(whole.end(), bytes.begin(), bytes.end());
    for (const std::uint8_t byte : whole) rx_[rx_write_++ % kBuffer] = byte;
    raise(0x04);
    return true;
  }
  bool calls() const {
    return at(kCommon, 0x18) == 1 && (at(kSocket, 0x02) & at(kSocket, 0x2C)) != 0;
  }
  /// Resets all state, as after a spike.
  void forget() {
    for (auto& block : registers_) block.fill(0);
    at(kCommon, 0x39) = 4;
    rx_write_ = taken_ = 0;
  }
  void be_another_chip() { other_ = true; }
  /// Initial value of both pointers, as after a day.
  void begin_at(std::uint16_t pointer) {
    rx_write_ = taken_ = pointer;
    set16(kSocket, 0x28, pointer);
    set16(kSocket, 0x22, pointer);
    set16(kSocket, 0x24, pointer);
  }
  /// Corrupts the size of the pending datagram in the buffer.
  void spoil_size(std::uint16_t size) {
    const std::uint16_t read = get16(kSocket, 0x28);
    rx_[(read + 6u) % kBuffer] = static_cast<std::uint8_t>(size >> 8);
    rx_[(read + 7u) % kBuffer] = static_cast<std::uint8_t>(size);
  }

  std::vector<Datagram> sent;
  int arps = 0;
  bool nobody_answers = false, slow = false;
  /// Completes a slow transmission.
  void finish() { raise(nobody_answers ? 0x08 : 0x10); }
  const std::uint8_t* common() const { return registers_[kCommon].data(); }
  const std::uint8_t* socket() const { return registers_[kSocket].data(); }

 private:
  enum Block : std::size_t { kCommon, kSocket, kBlocks };
  static constexpr std::size_t kBuffer = 2048;

  std::uint8_t& at(Block block, std::size_t i) { return registers_[block][i % 64]; }
  std::uint8_t at(Block block, std::size_t i) const { return registers_[block][i % 64]; }
  std::uint16_t get16(Block block, std::size_t i) const {
    return static_cast<std::uint16_t>(at(block, i) << 8 | at(block, i + 1));
  }
  void set16(Block block, std::size_t i, unsigned value) {
    at(block, i) = static_cast<std::uint8_t>(value >> 8);
    at(block, i + 1) = static_cast<std::uint8_t>(value);
  }
  std::size_t waiting() const { return static_cast<std::uint16_t>(rx_write_ - taken_); }
  void raise(std::uint8_t what) {
    at(kSocket, 0x02) = static_cast<std::uint8_t>(at(kSocket, 0x02) | what);
  }

  void select(bool on) {
    if (on) header_ = 0;
  }

  std::uint8_t exchange(std::uint8_t out) {
    if (other_) return 0xFF;
    if (header_ < 2) {
      address_ = static_cast<std::uint16_t>(address_ << 8 | out);
      ++header_;
      return 0x01;
    }
    if (header_ == 2) {
      control_ = out;
      ++header_;
      return 0x02;
    }
    const std::uint16_t where = address_++;
    const bool write = (control_ & 0x04) != 0;
    switch (control_ >> 3) {
      case 2:
        if (write) tx_[where % kBuffer] = out;
        return tx_[where % kBuffer];
      case 3: return rx_[where % kBuffer];
      case 0: return touch(kCommon, where, write, out);
      default: return touch(kSocket, where, write, out);
    }
  }

  std::uint8_t touch(Block block, std::uint16_t where, bool write, std::uint8_t out) {
    if (block == kSocket && (where == 0x26 || where == 0x27))
      set16(kSocket, 0x26, static_cast<unsigned>(waiting()));
    if (!write) return at(block, where);
    if (block == kSocket && where == 0x02) {
      at(block, where) = static_cast<std::uint8_t>(at(block, where) & ~out);
    } else if (block == kSocket && where == 0x01) {
      obey(out);
    } else if (block == kCommon && where == 0x00) {
      if ((out & 0x80) != 0) forget();
    } else {
      at(block, where) = out;
    }
    return 0;
  }

  void obey(std::uint8_t command) {
    if (command == 0x01) {  // OPEN
      at(kSocket, 0x03) = at(kSocket, 0x00) == 0x02 ? 0x22 : 0x00;
      taken_ = get16(kSocket, 0x28);
    } else if (command == 0x40) {  // RECV
      taken_ = get16(kSocket, 0x28);
    } else if (command == 0x20 || command == 0x21) {  // SEND, SEND_MAC
      send(command == 0x20);
    }
  }

  void send(bool ask) {
    arps += ask ? 1 : 0;
    std::vector<std::uint8_t> bytes;
    std::uint16_t read = get16(kSocket, 0x22);
    while (read != get16(kSocket, 0x24)) bytes.push_back(tx_[read++ % kBuffer]);
    set16(kSocket, 0x22, read);
    w5500_peer to{};
    for (std::size_t i = 0; i < 4; ++i) to.address[i] = at(kSocket, 0x0C + i);
    to.port = get16(kSocket, 0x10);
    if (!nobody_answers || !ask) sent.push_back({to, bytes});
    if (!slow) finish();
  }

  std::array<std::array<std::uint8_t, 64>, kBlocks> registers_{};
  std::array<std::uint8_t, kBuffer> rx_{}, tx_{};
  std::uint16_t rx_write_ = 0, taken_ = 0, address_ = 0;
  std::uint8_t control_ = 0;
  int header_ = 0;
  bool other_ = false;
};

}  // namespace cellcal::test
