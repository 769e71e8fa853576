// One HTTP request: the page, a recording, a saved state, or the upgrade to a WebSocket. Then the connection is closed.
#include "engine/io/printable.hpp"
#include "engine/viewer/client.hpp"

#include <fmt/format.h>

#include <optional>

namespace trocar::engine::viewer {

namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;

constexpr std::chrono::seconds kRequest{3};   // for a request to come
constexpr std::chrono::seconds kPatience{15}; // for an answer to go
constexpr std::uint32_t kLargestHeader = 8192;

/// Headers of every answer: no caching, framing, content sniffing or referrer.
template <class Body>
void add_headers(http::response<Body>& response) {
    response.set(http::field::cache_control, "no-store");
    response.set("Referrer-Policy", "no-referrer");
    response.set("X-Content-Type-Options", "nosniff");
    response.set("X-Frame-Options", "DENY");
    response.keep_alive(false);
}

class Connection : public Newcomer, public std::enable_shared_from_this<Connection> {
public:
    Connection(Hub& hub, Hub::Tcp::socket socket) : hub_(hub), stream_(std::move(socket)), counted_(hub.count_connection()) {}

    void start() {
        parser_.emplace();
        parser_->header_limit(kLargestHeader);
        parser_->body_limit(0);
        stream_.expires_after(kRequest);
        hub_.add_newcomer(weak_from_this());
        http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](beast::error_code failed, std::size_t) {
            self->waits_ = false;
            if (failed == http::error::header_limit || failed == http::error::body_limit)
                return self->answer(http::status::payload_too_large, "text/plain", "the request is too long\n");
            if (failed && failed != http::error::end_of_stream &&
                failed.category() == http::make_error_code(http::error::bad_method).category())
                return self->answer(http::status::bad_request, "text/plain", "this is no HTTP request\n");
            if (!failed) self->route(self->parser_->release());
        });
    }

    bool give_up() override {
        if (waits_) stream_.close();
        return waits_;
    }

private:
    using Request = http::request<http::empty_body>;
    static std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

    void route(Request request) {
        const RequestTarget target = split_target(view(request.target()));
        const std::string_view host = view(request[http::field::host]);
        is_head_ = request.method() == http::verb::head;
        if (!hub_.gate().accepts_host(host)) return refuse("this name does not belong to the page's server");
        if (!hub_.gate().accepts_origin(view(request[http::field::origin]), host)) return refuse("another site's page may not come in");
        if (!hub_.gate().knows(target.token)) return refuse("the address lacks the token that `trocar view` printed");
        if (request.method() != http::verb::get && !is_head_)
            return answer(http::status::method_not_allowed, "text/plain", "expected GET\n");
        if (target.path == "/") return answer(http::status::ok, "text/html; charset=utf-8", hub_.page());
        if (target.path == "/recording.csv") return send_recording();
        if (target.path == "/state.bin") return send_state(target.saved);
        if (target.path != "/ws") return answer(http::status::not_found, "text/plain", "there is no such page\n");
        if (!beast::websocket::is_upgrade(request)) return answer(http::status::upgrade_required, "text/plain", "expected a WebSocket\n");
        if (!hub_.has_free_place()) return answer(http::status::service_unavailable, "text/plain", "there are too many viewers\n");
        std::make_shared<Client>(hub_, std::move(stream_), std::move(counted_))->start(request);
    }

    void refuse(const char* why) { answer(http::status::forbidden, "text/plain", std::string(why) + "\n"); }

    void send_state(std::uint32_t id) {
        const bool asked = id != 0 && hub_.ask_for(Seal{id}, [self = shared_from_this()](const Sealed& sealed) {
            if (!sealed.saved) return self->answer(http::status::not_found, "text/plain", "there is no such saved state\n");
            self->file_name_ = safe_file_name(fmt::format("{}-{}", self->hub_.scene().name, sealed.saved->mark.name.data())) + ".bin";
            self->answer(http::status::ok, "application/octet-stream", self->hub_.checkpoint_of(*sealed.saved));
        });
        if (asked) return;
        if (id == 0) return answer(http::status::not_found, "text/plain", "expected the number of a saved state\n");
        answer(http::status::service_unavailable, "text/plain", "too much waits for the simulation; try again\n");
    }

    void send_recording() {
        const bool asked = hub_.ask_for(Seal{}, [self = shared_from_this()](const Sealed& sealed) {
            if (!sealed.recording) return self->answer(http::status::not_found, "text/plain", "the scene has no instrument to record\n");
            self->file_name_ = safe_file_name(self->hub_.scene().name) + ".csv";
            self->answer(http::status::ok, "text/csv", sealed.recording->text(self->hub_.scene(), sealed.steps, sealed.state_hash));
        });
        if (!asked) answer(http::status::service_unavailable, "text/plain", "too much waits for the simulation; try again\n");
    }

    void answer(http::status status, const char* type, std::string body) {
        response_.result(status);
        response_.version(11);
        response_.set(http::field::content_type, type);
        if (!file_name_.empty()) response_.set(http::field::content_disposition, fmt::format("attachment; filename=\"{}\"", file_name_));
        add_headers(response_);
        response_.content_length(body.size());
        if (!is_head_) response_.body() = std::move(body);
        stream_.expires_after(kPatience);
        http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code, std::size_t) {
            beast::error_code ignored;
            self->stream_.socket().shutdown(Hub::Tcp::socket::shutdown_send, ignored);
        });
    }

    Hub& hub_;
    beast::tcp_stream stream_;
    std::shared_ptr<void> counted_;
    beast::flat_buffer buffer_{2 * kLargestHeader};
    std::optional<http::request_parser<http::empty_body>> parser_;
    http::response<http::string_body> response_;
    std::string file_name_;
    bool is_head_ = false, waits_ = true;
};

} // namespace

void serve_connection(Hub& hub, Hub::Tcp::socket socket) { std::make_shared<Connection>(hub, std::move(socket))->start(); }

} // namespace trocar::engine::viewer
