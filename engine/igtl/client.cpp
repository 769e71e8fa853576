// One client of the bridge. A message is read to its end before the next one, into memory of a fixed size; of what is written one batch is
// on its way at a time, answers before frames, and frames wait nowhere: when a batch is through, the latest one goes next.
#include "engine/igtl/bridge.hpp"
#include "engine/igtl/read_wish.hpp"
#include "engine/io/printable.hpp"
#include "engine/time/clock.hpp"

#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

namespace trocar::engine::igtl {

namespace {

/// Bytes of a body that is read; a TRANSFORM has 48, a STRING at most 65,539. Longer ones are passed over, piece by piece.
constexpr std::uint64_t kLargestBody = 70'000;
/// Bytes that are passed over; after a header that asks for more the connection is closed.
constexpr std::uint64_t kMostPassedOver = 256ull << 20;
/// Answers that wait for a client that does not read; further ones are left out.
constexpr std::size_t kMostAnswers = 64;
/// Bytes that the system keeps for a client that reads slowly: frames that lie there are old when they are seen.
constexpr int kSendBuffer = 256 * 1024;
/// A client that does not take a batch to its end within this time is disconnected.
constexpr std::chrono::seconds kPatience{30};

/// Packed once: the library loses some of its memory with every one.
const std::string& capability() {
    static const std::string kPacked =
        pack_capability(kProgramDevice, {"TRANSFORM", "STRING", "POLYDATA", "STATUS", "GET_POLYDATA", "GET_STATUS", "GET_CAPABIL"});
    return kPacked;
}

template <class... Ts>
struct Overloaded : Ts... {
    using Ts::operator()...;
};

class Client final : public viewer::Viewer, public std::enable_shared_from_this<Client> {
public:
    using ErrorCode = boost::system::error_code;

    Client(std::shared_ptr<Bridge> bridge, Bridge::Tcp::socket socket)
        : bridge_(std::move(bridge)), socket_(std::move(socket)), patience_(bridge_->hub().io()), rest_(bridge_->hub().io()) {
        bridge_->count_client(1);
    }
    ~Client() override {
        if (number_ != 0) bridge_->hub().leave(number_);
        bridge_->count_client(-1);
    }

    void start() {
        ErrorCode ignored;
        socket_.set_option(Bridge::Tcp::no_delay(true), ignored);
        socket_.set_option(boost::asio::socket_base::keep_alive(true), ignored);
        socket_.set_option(boost::asio::socket_base::send_buffer_size(kSendBuffer), ignored);
        number_ = bridge_->hub().join(shared_from_this());
        scene_due_ = true; // it goes with the first frame
        read_header();
    }

    [[nodiscard]] bool is_idle() const noexcept override { return !seen_ || (!writing_ && answers_.empty() && rest_ns() <= 0); }
    [[nodiscard]] bool wants_spheres() const noexcept override { return false; }
    void show_spheres(bool) noexcept override {}
    [[nodiscard]] bool wants_xray() const noexcept override { return false; }
    void show_xray(bool) noexcept override {}
    void xray_is_due() override {}
    void frame_is_due() override {
        frame_due_ = true;
        const bool first = !std::exchange(seen_, true);
        if (first && early_) move_to(*early_);
        write_next();
    }

private:
    // ---------------------------------------------------------------- in

    void read_header() {
        boost::asio::async_read(socket_, boost::asio::buffer(head_), [self = shared_from_this()](const ErrorCode& failed, std::size_t) {
            if (failed) return self->end(); // gone: the destructor leaves
            self->header_ = igtl::read_header({self->head_.data(), self->head_.size()});
            self->on_header();
        });
    }

    void on_header() {
        const std::uint64_t size = header_.body_size;
        if (header_.version == 0 || header_.version > kNewestHeader) {
            bridge_->complain(Complaint::NoMessage, "OpenIGTLink: a client sent bytes that are no header of version 1 or 2; it is disconnected");
            return end();
        }
        if (size > kMostPassedOver) {
            bridge_->complain(Complaint::TooLong, fmt::format("OpenIGTLink: a client announced a message of {} bytes; it is disconnected", size));
            return end();
        }
        if (size > kLargestBody) {
            bridge_->complain(Complaint::TooLong, fmt::format("OpenIGTLink: a message of {} bytes is passed over; expected at most {}", size, kLargestBody));
            return pass_over(size);
        }
        body_.resize(size);
        boost::asio::async_read(socket_, boost::asio::buffer(body_), [self = shared_from_this()](const ErrorCode& failed, std::size_t) {
            if (failed) return self->end();
            self->on_message();
            self->read_header();
        });
    }

    void pass_over(std::uint64_t left) {
        body_.resize(kLargestBody);
        const auto piece = boost::asio::buffer(body_.data(), std::min<std::uint64_t>(left, body_.size()));
        socket_.async_read_some(piece, [self = shared_from_this(), left](const ErrorCode& failed, std::size_t read) {
            if (failed) return self->end();
            if (read < left) return self->pass_over(left - read);
            self->read_header();
        });
    }

    void on_message() {
        const std::string_view body(body_.data(), body_.size());
        if (!has_its_checksum(header_, body)) {
            bridge_->complain(Complaint::BadChecksum, "OpenIGTLink: a message without its checksum is left out");
            return answer(Status::BadChecksum, "the checksum is another one; the message is left out");
        }
        const auto content = content_of(header_, body);
        if (!content) return refuse(Status::UnknownInstruction, "the second header or the metadata do not fit into the message");
        const double now = bridge_->time_s();
        if (header_.type == "GET_POLYDATA")
            scene_due_ = true;
        else if (header_.type == "GET_STATUS")
            status_due_ = true;
        else if (header_.type == "GET_CAPABIL")
            say(capability());
        else if (header_.type == "TRANSFORM")
            on_transform(*content);
        else if (header_.type == "STRING")
            on_string(*content);
        else if (header_.type != "STATUS") { // a client's own, which asks for nothing
            bridge_->complain(Complaint::Unknown, fmt::format("OpenIGTLink: messages of type {} are left out", printable(header_.type)));
            say(pack_status(kProgramDevice, now, Status::UnknownInstruction,
                            fmt::format("{} means nothing here; expected TRANSFORM, STRING, GET_POLYDATA, GET_STATUS or GET_CAPABIL", printable(header_.type))));
        }
        write_next();
    }

    void on_transform(std::string_view content) {
        const auto transform = read_transform(header_, content);
        if (!transform) return refuse(Status::UnknownInstruction, fmt::format("a TRANSFORM of {} bytes; expected 48", content.size()));
        grant(read_drive(header_.name, *transform, bridge_->model(), bridge_->devices()));
    }

    void on_string(std::string_view content) {
        const auto text = read_string(header_, content);
        if (!text) return refuse(Status::UnknownInstruction, "a STRING whose length is another one than it says");
        grant(igtl::read_command(*text, bridge_->model(), bridge_->devices()));
    }

    void refuse(Status code, const std::string& sentence) {
        bridge_->complain(Complaint::Refused, "OpenIGTLink: refused, and the client told: " + sentence);
        answer(code, sentence);
    }

    void grant(const Result<Wish>& wish) {
        if (!wish.ok()) return refuse(wish.error().code == trocar::ErrorCode::BadUsage ? Status::NotFound : Status::UnknownInstruction, wish.error().message);
        std::visit(Overloaded{
                       [&](const SendSurfaces&) { scene_due_ = true; },
                       [&](const viewer::TakeSeat&) { (void)has_seat(); },
                       [&](const viewer::LeaveSeat&) { bridge_->hub().leave_seat(number_); },
                       [&](const InsertAt& insert) { drive({insert.share, drive_.rotation}); },
                       [&](const RotateAt& rotate) { drive({drive_.insertion, rotate.share}); },
                       [&](const MoveTo& to) { move_to(to); },
                       [&](const viewer::Command& command) {
                           if (std::holds_alternative<viewer::Drive>(command) || std::holds_alternative<viewer::Restart>(command)) drive_ = {};
                           turned_.reset();
                           early_.reset();
                           submit(command);
                       },
                   },
                   *wish);
    }

    [[nodiscard]] bool has_seat() {
        const std::string refused = bridge_->hub().take_seat(number_);
        if (!refused.empty()) answer(Status::AccessDenied, refused);
        return refused.empty();
    }

    bool submit(const viewer::Command& command) {
        if (!has_seat()) return false;
        const std::string refused = bridge_->hub().submit(number_, command, true);
        if (!refused.empty()) answer(Status::Busy, refused);
        return refused.empty();
    }

    void drive(const viewer::Drive& speeds) {
        turned_.reset();
        early_.reset();
        if (submit(viewer::Command{speeds})) drive_ = speeds;
    }

    /// Of all turns with the same matrix the one that is nearest to the last: a handle that is turned on and on goes on and on.
    void move_to(const MoveTo& to) {
        if (!seen_) { // what is shown is as old as the last visit
            early_ = to;
            return;
        }
        const viewer::Snapshot& shown = bridge_->hub().shown();
        if (!turned_ || run_ != shown.run) turned_ = shown.report.rotation_rad;
        run_ = shown.run;
        const double rotation = *turned_ + std::remainder(to.angle - *turned_, 2.0 * std::numbers::pi);
        if (!submit(viewer::Command{viewer::DriveTo{to.insertion, rotation}})) return;
        turned_ = rotation;
        drive_ = {};
    }

    // ---------------------------------------------------------------- out

    void answer(Status code, const std::string& sentence) { say(pack_status(kProgramDevice, bridge_->time_s(), code, sentence)); }

    void say(std::string bytes) {
        if (answers_.size() < kMostAnswers)
            answers_.push_back(std::make_shared<const std::string>(std::move(bytes)));
        else
            bridge_->complain(Complaint::NotRead, "OpenIGTLink: a client does not read its answers; some are left out");
        write_next();
    }

    /// ns until the next frame may go.
    [[nodiscard]] std::int64_t rest_ns() const noexcept { return last_frame_ns_ == 0 ? 0 : last_frame_ns_ + bridge_->interval_ns() - monotonic_ns(); }

    void write_next() {
        if (writing_ || ended_ || !seen_) return;
        batch_ = std::move(answers_);
        answers_.clear();
        if (std::exchange(scene_due_, false))
            for (Bridge::Packed& message : bridge_->scene()) batch_.push_back(std::move(message));
        if (frame_due_) add_frame();
        if (std::exchange(status_due_, false)) add_status();
        if (!batch_.empty()) write();
    }

    void add_frame() {
        if (const std::int64_t rest = rest_ns(); rest > 0) { // the latest one goes then, also where no other follows
            rest_.expires_after(std::chrono::nanoseconds(rest));
            return rest_.async_wait([weak = weak_from_this()](const ErrorCode& failed) {
                if (const auto self = weak.lock(); self != nullptr && !failed) self->write_next();
            });
        }
        frame_due_ = false;
        last_frame_ns_ = monotonic_ns();
        const std::vector<Bridge::Packed>& frame = bridge_->frame();
        batch_.insert(batch_.end(), frame.begin(), frame.end());
        if (bridge_->status() != told_) status_due_ = true;
    }

    void add_status() {
        told_ = bridge_->status();
        batch_.push_back(std::make_shared<const std::string>(pack_status(kProgramDevice, bridge_->time_s(), told_.first, told_.second)));
    }

    void write() {
        writing_ = true;
        std::vector<boost::asio::const_buffer> buffers;
        for (const Bridge::Packed& message : batch_) buffers.push_back(boost::asio::buffer(*message));
        patience_.expires_after(kPatience);
        patience_.async_wait([weak = weak_from_this()](const ErrorCode& failed) {
            const auto self = weak.lock();
            if (failed || self == nullptr) return;
            self->bridge_->complain(Complaint::NotRead, "OpenIGTLink: a client does not read; it is disconnected");
            self->end();
        });
        boost::asio::async_write(socket_, buffers, [self = shared_from_this()](const ErrorCode& failed, std::size_t) {
            self->patience_.cancel();
            self->writing_ = false;
            self->batch_.clear();
            if (failed) return self->end();
            self->write_next();
        });
    }

    /// What waits on the socket ends with an error, and with the last of it the client.
    void end() {
        ended_ = true;
        ErrorCode ignored;
        socket_.close(ignored);
        rest_.cancel();
    }

    std::shared_ptr<Bridge> bridge_; // goes last
    Bridge::Tcp::socket socket_;
    boost::asio::steady_timer patience_, rest_;
    std::array<char, kHeaderSize> head_{};
    Header header_;
    std::vector<char> body_;
    std::vector<Bridge::Packed> answers_, batch_; // waiting, on their way
    std::pair<Status, std::string> told_{Status::Ok, ""};
    viewer::Drive drive_;           // speeds that it asked for last
    std::optional<double> turned_;  // rad, that it turned the handle to last
    std::uint64_t run_ = 0;         // in which it did
    std::optional<MoveTo> early_;   // asked for before the first frame
    std::int64_t last_frame_ns_ = 0;
    unsigned number_ = 0; // 0: not joined
    bool writing_ = false, ended_ = false, frame_due_ = false, scene_due_ = false, status_due_ = false;
    bool seen_ = false; // the session as it has been since it came
};

} // namespace

void serve_client(std::shared_ptr<Bridge> bridge, Bridge::Tcp::socket socket) { std::make_shared<Client>(std::move(bridge), std::move(socket))->start(); }

} // namespace trocar::engine::igtl
