#include "tune/tabs.h"

#include <algorithm>

namespace offstage::tune {

std::optional<uint64_t> Tabs::open(const std::string& tab) {
  const std::lock_guard lock(mutex_);
  const auto known = tabs_.find(tab);
  if (closed_ || (known == tabs_.end() && tabs_.size() >= kMostTabs)) return {};
  Tab& entry = tabs_[tab];
  const uint64_t ticket = ++tickets_;
  if (entry.since == 0) entry.since = ticket;
  entry.ticket = ticket;
  entry.mailbox.clear();
  changed_.notify_all();
  choose_writer();
  return ticket;
}

void Tabs::close(const std::string& tab, uint64_t ticket) {
  const std::lock_guard lock(mutex_);
  const auto known = tabs_.find(tab);
  if (known == tabs_.end() || known->second.ticket != ticket) return;
  tabs_.erase(known);
  choose_writer();
}

void Tabs::close_all() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

void Tabs::choose_writer() {
  if (tabs_.contains(writer_)) return;
  const std::string before = writer_;
  const auto first =
      std::ranges::min_element(tabs_, {}, [](const auto& entry) { return entry.second.since; });
  writer_ = first == tabs_.end() ? "" : first->first;
  if (writer_ == before) return;
  for (auto& [name, tab] : tabs_) put(tab, "writer", "{\"writer\":\"" + writer_ + "\"}");
  changed_.notify_all();
}

void Tabs::put(Tab& tab, const std::string& kind, const std::string& json) {
  std::erase_if(tab.mailbox, [&](const Message& message) { return message.kind == kind; });
  tab.mailbox.push_back({kind, json});
}

void Tabs::post(const std::string& kind, const std::string& json) {
  const std::lock_guard lock(mutex_);
  for (auto& [name, tab] : tabs_) put(tab, kind, json);
  changed_.notify_all();
}

Tabs::Next Tabs::wait(const std::string& tab, uint64_t ticket, std::chrono::milliseconds limit) {
  std::unique_lock lock(mutex_);
  const auto is_over = [&] {
    const auto known = tabs_.find(tab);
    return closed_ || known == tabs_.end() || known->second.ticket != ticket;
  };
  changed_.wait_for(lock, limit, [&] { return is_over() || !tabs_[tab].mailbox.empty(); });
  if (is_over()) return {.message = {}, .over = true};
  std::deque<Message>& mailbox = tabs_[tab].mailbox;
  if (mailbox.empty()) return {};
  Next next{std::move(mailbox.front()), false};
  mailbox.pop_front();
  return next;
}

std::string Tabs::writer() const {
  const std::lock_guard lock(mutex_);
  return writer_;
}

bool Tabs::take_over(const std::string& tab) {
  const std::lock_guard lock(mutex_);
  if (!tabs_.contains(tab)) return false;
  writer_ = tab;
  for (auto& [name, other] : tabs_) put(other, "writer", "{\"writer\":\"" + writer_ + "\"}");
  changed_.notify_all();
  return true;
}

std::size_t Tabs::count() const {
  const std::lock_guard lock(mutex_);
  return tabs_.size();
}

}  // namespace offstage::tune
