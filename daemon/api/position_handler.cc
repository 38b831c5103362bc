// Where the arm stands, for teaching: no session runs meanwhile, and nothing moves by it.

#include <nlohmann/json.hpp>

#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/routes.h"
#include "daemon/frames/frame_words.h"

namespace cellcal::daemon {

std::optional<Response> Api::read_position(const Call&) {
  const ReadPosition read = position_ ? position_() : nullptr;
  if (!read) throw NotFound(no_position_words());
  drivers::EkiPosition position;
  service_.alone("reading the arm's position", [&] { position = read(); });
  if (position.trouble != drivers::EkiPositionTrouble::kNone)
    throw BusyError(position_words(position));
  return Response{.body = dump({{"axes_deg", position.axes_deg}})};
}

}  // namespace cellcal::daemon
