#include "engine/viewer/client.hpp"

#include <utility>

namespace trocar::engine::viewer {

namespace {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;

/// Bytes that are read of one message before the connection is closed; longer than kLongestMessage, so that what is only a
/// little too long gets an answer.
constexpr std::size_t kLargestRead = 64 * 1024;
/// Bytes that the system keeps for a viewer that reads slowly: frames that lie there are old when they are seen.
constexpr int kSendBuffer = 256 * 1024;
/// Answers that wait for a viewer that does not read; then it is closed.
constexpr std::size_t kMostAnswers = 64;
/// A viewer that sends nothing for so long, not even a pong, is disconnected.
constexpr std::chrono::seconds kIdle{30}, kHandshake{10};

} // namespace

Client::Client(Hub& hub, beast::tcp_stream stream, std::shared_ptr<void> connection)
    : hub_(hub), stream_(std::move(stream)), connection_(std::move(connection)) {}

Client::~Client() {
    if (number_ != 0) hub_.leave(number_);
}

void Client::start(const Upgrade& request) {
    beast::get_lowest_layer(stream_).expires_never(); // the WebSocket has limits of its own
    boost::system::error_code ignored;
    beast::get_lowest_layer(stream_).socket().set_option(boost::asio::ip::tcp::no_delay(true), ignored);
    beast::get_lowest_layer(stream_).socket().set_option(boost::asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    stream_.set_option(websocket::stream_base::timeout{kHandshake, kIdle, true});
    stream_.read_message_max(kLargestRead);
    stream_.auto_fragment(false);
    stream_.async_accept(request, [self = shared_from_this()](beast::error_code failed) {
        if (!failed) self->greet();
    });
}

void Client::greet() {
    open_ = true;
    number_ = hub_.join(shared_from_this());
    plot_cursor_ = hub_.plot_begin();
    out_.push_back({hub_.scene_text(), false});
    for (const auto& message : hub_.model_messages()) out_.push_back({message, true});
    out_.push_back({std::make_shared<const std::string>(hub_.picks_text()), false});
    write_next();
    read();
}

void Client::read() {
    stream_.async_read(buffer_, [self = shared_from_this()](beast::error_code failed, std::size_t size) {
        if (failed) return; // gone, or too long: the destructor leaves
        self->on_message(size);
        if (!self->closing_) self->read();
    });
}

void Client::on_message(std::size_t size) {
    const std::string_view text(static_cast<const char*>(buffer_.data().data()), size);
    if (!stream_.got_text())
        say(error_message("binary messages mean nothing here; expected JSON text"));
    else if (const auto request = read_request(text, hub_.range()); !request.ok())
        say(error_message(request.error().message));
    else
        say(hub_.handle(number_, *request));
    buffer_.consume(buffer_.size());
}

void Client::say(std::string text) {
    if (text.empty() || closing_) return;
    if (out_.size() >= kMostAnswers) return close(websocket::close_code::policy_error, "answers are not read");
    out_.push_back({std::make_shared<const std::string>(std::move(text)), false});
    write_next();
}

void Client::frame_is_due() {
    frame_due_ = true;
    write_next();
}

void Client::xray_is_due() {
    xray_due_ = true;
    write_next();
}

/// Answers first, then the status that belongs to the frame that went, the latest X-ray picture, the latest frame.
void Client::write_next() {
    if (writing_ || !open_ || closing_) return;
    if (!out_.empty()) {
        Message message = std::move(out_.front());
        out_.pop_front();
        write(std::move(message));
    } else if (status_of_ != 0) {
        status_of_ = 0;
        write({std::make_shared<const std::string>(hub_.status_for(number_, plot_cursor_)), false});
    } else if (std::exchange(xray_due_, false) && hub_.xray() != nullptr) {
        write({hub_.xray(), true});
    } else if (frame_due_) {
        frame_due_ = false;
        const auto frame = hub_.frames().encode(base_);
        if (frame == nullptr) return;
        status_of_ = base_ = hub_.frames().latest();
        write({frame, true});
    }
}

void Client::write(Message message) {
    writing_ = true;
    stream_.binary(message.binary);
    const auto buffer = boost::asio::buffer(*message.bytes);
    stream_.async_write(buffer, [self = shared_from_this(), bytes = std::move(message.bytes)](beast::error_code failed, std::size_t) {
        self->writing_ = false;
        if (failed)
            self->open_ = false;
        else
            self->write_next();
    });
}

void Client::close(websocket::close_code code, const char* reason) {
    closing_ = true;
    out_.clear();
    if (writing_) { // a viewer that takes nothing would not read a close frame either
        boost::system::error_code ignored;
        beast::get_lowest_layer(stream_).socket().close(ignored);
        return;
    }
    stream_.async_close({code, reason}, [self = shared_from_this()](beast::error_code) {});
}

} // namespace trocar::engine::viewer
