#pragma once
// KUKA's EthernetKRL option from KRL's point of view: one channel, described by the same XML file
// that is installed on the controller. TCP server, one client, a queue per element, and its
// pitfalls: an overflow closes the connection, and queues keep data of an earlier client.
//
// Names are case-insensitive and elements may come in any order, more tolerant than a real
// controller. Sans I/O: connections and bytes come from outside.

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/kuka/wire/eki_codec.h"

namespace cellcal::sim {

enum class EkiElementType { kBool, kInt, kReal, kString };

struct EkiChannelConfig {
  std::uint16_t port = 54600;
  std::size_t limit = 16;         ///< BUFFERING/@Limit: queued values per element
  std::size_t bytes = 16384;      ///< BUFFSIZE/@Limit: of one telegram
  bool udp = false;               ///< PROTOCOL: a datagram is a telegram
  bool survives_reset = false;    ///< ENVIRONMENT is Submit or System
  std::optional<int> alive_flag;  ///< ALIVE/@Set_Flag
  std::vector<std::pair<std::string, EkiElementType>> receive;  ///< "RobotCommand/Axis/@A1"
  std::vector<std::string> send;                                ///< in the file's order

  /// Throws std::invalid_argument naming a missing or unknown item of the file.
  static EkiChannelConfig parse(std::string_view xml);
};

/// In EKI's format of a REAL: a 32-bit float with six decimals.
std::string eki_real(double value);

class EkiChannel {
 public:
  explicit EkiChannel(EkiChannelConfig config);

  // ---- KRL interface
  /// EKI_Init: creates the channel, empty and closed, unless it exists.
  void init() { exists_ = true; }
  /// Without EKI_Init nothing is opened.
  void open() { open_ = exists_; }
  void close();
  void empty_queues();
  /// EKI_Clear: empties all queues and closes.
  void clear();
  /// True if EKI_CheckBuffer returns without a message.
  bool exists() const { return exists_; }
  std::size_t waiting(std::string_view path) const;
  /// EKI_GetReal, EKI_GetInt: removes and returns the oldest value.
  std::optional<double> get(std::string_view path);
  void set(std::string_view path, std::string text);
  /// EKI_Send(channel, root): all elements of that root in the file.
  void send(std::string_view root);

  // ---- controller
  /// Reconfigure I/Os, hibernating: the channel is deleted with all queued data.
  void remove();

  // ---- network
  /// A client connects. False: refused, since the port is closed or another client is connected.
  bool connect();
  void disconnect();
  bool connected() const { return connected_; }
  void receive(std::string_view bytes);
  /// Bytes for the client since the last call.
  std::string drain_output();

  const EkiChannelConfig& config() const { return config_; }
  /// EKI's message log, newest last.
  const std::vector<std::string>& messages() const { return messages_; }

 private:
  struct Queue {
    EkiElementType type = EkiElementType::kReal;
    std::deque<double> values;
  };
  void take(std::string_view document);
  void overflow(const std::string& what);
  void drop_client();

  EkiChannelConfig config_;
  drivers::EkiFramer framer_;
  bool exists_ = true, open_ = false, connected_ = false;
  std::map<std::string, Queue, std::less<>> queues_;        // by path in lower case
  std::map<std::string, std::string, std::less<>> values_;  // to be sent, likewise
  std::string output_;
  std::vector<std::string> messages_;
};

}  // namespace cellcal::sim
