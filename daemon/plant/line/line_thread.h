#pragma once
// A line that is opened anew after each loss, on a thread of its own, until an orderly end.

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "daemon/files/log_context.h"
#include "daemon/plant/line/mqtt_line.h"

namespace cellcal::daemon::plant {

/// start() and status_now() by the owner, all else on the thread of the context.
struct LineThread {
  LineThread(std::chrono::milliseconds first_wait, std::chrono::milliseconds longest_wait)
      : backoff(first_wait, longest_wait) {}
  virtual ~LineThread() = default;

  virtual void connect() = 0;
  void start();
  void connect_later();
  /// True: the farewell is to be sent; the thread ends after `longest` at the latest. Otherwise it ends.
  bool begin_farewell(std::chrono::milliseconds longest);
  void set(const std::function<void(LineStatus&)>& change);
  LineStatus status_now() const;

  boost::asio::io_context context;
  boost::asio::steady_timer retry{context}, last{context};
  Backoff backoff;
  Takeovers takeovers;
  std::unique_ptr<MqttLine> line;
  OccurrenceLimit connections;
  std::map<LineProblem, OccurrenceLimit> warnings;
  bool is_up = false, stopping = false;
  bool orderly = true;  ///< false: ends as a lost line, with the will
  mutable std::mutex status_mutex;
  LineStatus status;
  std::thread thread;
};

}  // namespace cellcal::daemon::plant
