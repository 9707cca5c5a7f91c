#pragma once
/// The browser tabs of a session. Each tab has one event stream, and a mailbox with the latest message of
/// each kind. A slow tab therefore misses some messages, but does not block other tabs or use more and more
/// memory. One tab is the writer, which may change the scene; the other tabs only show it. Safe from several
/// threads.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace offstage::tune {

inline constexpr std::size_t kMostTabs = 8;

class Tabs {
 public:
  struct Message {
    std::string kind;  ///< "frame", "cell:3"; a later message of the same kind replaces it
    std::string json;
  };

  /// Opens the stream of a tab and returns its ticket. An earlier stream of the same tab ends. Returns
  /// nothing if kMostTabs other tabs are open, or after close_all(). If there is no writer, the tab becomes
  /// the writer.
  std::optional<uint64_t> open(const std::string& tab);
  /// Removes a tab, unless it has a newer stream than this ticket's. If it was the writer, the tab that has
  /// been open longest becomes the writer.
  void close(const std::string& tab, uint64_t ticket);
  void close_all();

  /// Puts a message into every mailbox.
  void post(const std::string& kind, const std::string& json);
  /// Result of wait(): a message, or nothing at the time limit. `over`: the stream has ended.
  struct Next {
    std::optional<Message> message;
    bool over = false;
  };
  Next wait(const std::string& tab, uint64_t ticket, std::chrono::milliseconds limit);

  /// Returns the tab that may change the scene; empty if none is open.
  std::string writer() const;
  /// Makes a tab the writer; returns false if the tab is not open.
  bool take_over(const std::string& tab);
  std::size_t count() const;
  bool has_room() const { return count() < kMostTabs; }

 private:
  struct Tab {
    uint64_t ticket = 0, since = 0;
    std::deque<Message> mailbox;
  };
  void choose_writer();
  void put(Tab& tab, const std::string& kind, const std::string& json);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Tab> tabs_;
  std::string writer_;
  uint64_t tickets_ = 0;
  bool closed_ = false;
};

}  // namespace offstage::tune
