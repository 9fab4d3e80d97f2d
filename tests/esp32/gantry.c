/* SPDX-License-Identifier: MIT
 * A gantry with two motors at the registers of an ESP32: the whole machine with the chip's step engine,
 * inputs and interrupts, from lines of text to pins, and motors and switches at these pins. Compiled for each
 * chip and engine.
 *
 * Emulated are the cycle counter, both timers, GPIO with its matrix and edge interrupts, RMT channels that
 * play a pulse, and the I2S peripheral with its shift registers (i2s_model.h). The matrix is what it is on
 * the chip: each pin shows the signal that is routed to it, inverted or not. */
#include "app/board.h"
#include "app/follow.h"
#include "check.h"
#include "chip_ganged.h"
#include "hal/chip_hal.h"
#include "hal/i2s_registers.h"
#include "hal/rmt_registers.h"
#include "hal/step_i2s.h"
#include "hal/step_vector.h"
#include "i2s_model.h"
#include "input/rx.h"
#include "io/switch_timer.h"
#include "machine/parts.h"
#include "settings/store.h"

#include "driver/gpio.h"
#include "driver/rmt_tx.h"
#include "esp_rom_gpio.h"
#include "esp_rom_sys.h"
#include "esp_timer.h"
#include "soc/gpio_sig_map.h"
#include "soc/interrupts.h"
#include "soc/soc_caps.h"

#include <stdlib.h>
#include <string.h>

enum { CYCLES_PER_US = 240, CYCLES_PER_TICK = 12, ACCESS_CYCLES = 12, PINS = 64, CHANNELS = 8 };
#if CONFIG_IDF_TARGET_ESP32
enum { FIRST_JTAG = 12, SENDERS = 8 }; /* of four pins that are not GPIO at reset; RMT channels */
#else
enum { FIRST_JTAG = 39, SENDERS = 4 };
#endif
/* Numbers of motors. A board without a gantry has the driver of A as the second motor of Y by $211. */
enum { BY_SETTING = BOARD_GANGED_AXES == 0, FIRST_Y = 1, SECOND_Y = BY_SETTING ? AXIS_A : BOARD_AXIS_COUNT };

static uint64_t now; /* cycles */

/* ---- motors and switches at the pins ---- */

static struct motor {
    uint8_t step, dir, limit; /* pins */
    bool is_low;              /* steps at a falling edge */
    bool is_reversed;         /* wired the other way round */
    int32_t at, closes_at;    /* steps; the switch is closed from there on */
    bool high, negative;      /* as the lines show */
    uint64_t rose, fell, turned;
} motors[AXIS_COUNT];

static uint64_t pins_in = ~(uint64_t)0; /* all pulled up */
static uint64_t edges_on;               /* pins whose edges interrupt */
static gpio_dev_t gpio;

static void drive(uint8_t pin, bool high) {
    const uint64_t bit = (uint64_t)1 << pin, before = pins_in;
    pins_in = high ? pins_in | bit : pins_in & ~bit;
    const uint64_t edges = (pins_in ^ before) & edges_on;
    gpio.in = (uint32_t)pins_in;
    gpio.in1.val = (uint32_t)(pins_in >> 32);
    gpio.status |= (uint32_t)edges;
    gpio.status1.val |= (uint32_t)(edges >> 32);
}

static void place(unsigned motor, int32_t at) {
    motors[motor].at = at;
    drive(motors[motor].limit, at < motors[motor].closes_at);
}

static bool is_high(uint8_t pin, uint64_t levels) {
    return step_i2s_has(pin) ? (i2s_model_shown() & step_i2s_bit(pin)) != 0 : (levels >> pin & 1) != 0;
}

static void look_at_motor(unsigned n, uint64_t levels) {
    struct motor *motor = &motors[n];
    const bool high = is_high(motor->step, levels) != motor->is_low, negative = is_high(motor->dir, levels);
    if (negative != motor->negative) {
        CHECK(!high && !motor->high);
        motor->turned = now;
    }
    motor->negative = negative;
    if (high == motor->high)
        return;
    motor->high = high;
    if (!high) {
        CHECK(now - motor->rose >= BOARD_STEP_PULSE_NS * CYCLES_PER_US / 1000);
        motor->fell = now;
        return;
    }
    CHECK(now - motor->fell >= BOARD_STEP_PULSE_NS * CYCLES_PER_US / 1000);
    CHECK(now - motor->turned >= BOARD_DIR_SETUP_NS * CYCLES_PER_US / 1000);
    motor->rose = now;
    place(n, motor->at + (negative != motor->is_reversed ? -1 : 1));
}

/* ---- the GPIO matrix ---- */

static struct {
    bool is_gpio; /* the pad's function: at reset those of JTAG have another one */
    uint32_t signal;
    bool inverted;
} matrix[PINS];
static uint64_t out; /* GPIO_OUT, GPIO_OUT1 */
static bool plays[CHANNELS];
static uint64_t plays_until[CHANNELS];
static bool is_up; /* from here on the lines are a machine's */

static bool is_playing(uint32_t signal) {
    return signal >= RMT_SIG_OUT0_IDX && signal < RMT_SIG_OUT0_IDX + CHANNELS &&
           plays[signal - RMT_SIG_OUT0_IDX];
}

static void look_at_pins(void) {
    uint64_t levels = 0;
    for (unsigned pin = 0; pin < PINS; pin++) {
        const uint32_t signal = matrix[pin].signal;
        bool high = signal == SIG_GPIO_OUT_IDX ? (out >> pin & 1) != 0 : is_playing(signal);
        levels |= (uint64_t)(matrix[pin].is_gpio && high != matrix[pin].inverted) << pin;
    }
    for (unsigned n = 0; is_up && n < AXIS_COUNT; n++)
        if (motors[n].step != NO_PIN)
            look_at_motor(n, levels);
}

void esp_rom_gpio_connect_out_signal(uint32_t pin, uint32_t signal, bool inverted, bool enable_inverted) {
    const uint32_t before = matrix[pin].signal;
    (void)enable_inverted;
    CHECK(before == signal || !is_playing(before)); /* not cut short */
    matrix[pin].signal = signal;
    matrix[pin].inverted = inverted;
    i2s_model_connect(pin, signal, now);
    look_at_pins();
}

/* What the registers show changes in the middle of what the processor does. */
void lines_show(uint32_t before, uint32_t word, uint64_t at, uint64_t due) {
    const uint64_t later = now;
    (void)before, (void)word, (void)due;
    now = at;
    look_at_pins();
    now = later;
}

/* ---- registers ---- */

static rmt_dev_t rmt;
volatile uint32_t RMTMEM[CHANNELS][SOC_RMT_MEM_WORDS_PER_CHANNEL];
static timg_dev_t timer;
static mcpwm_dev_t pwm;

static void look_at_gpio(void) {
    out |= gpio.out_w1ts | (uint64_t)gpio.out1_w1ts.val << 32;
    out &= ~(gpio.out_w1tc | (uint64_t)gpio.out1_w1tc.val << 32);
    gpio.status &= ~gpio.status_w1tc;
    gpio.status1.val &= ~gpio.status1_w1tc.val;
    gpio.out_w1ts = gpio.out_w1tc = gpio.out1_w1ts.val = gpio.out1_w1tc.val = 0;
    gpio.status_w1tc = gpio.status1_w1tc.val = 0;
}

/* A start plays high for as long as the channel's first word says. */
static void look_at_rmt(void) {
    if (BOARD_STEP_ENGINE != BOARD_STEP_ENGINE_RMT)
        return;
    for (unsigned channel = 0; channel < SENDERS; channel++) {
        const uint32_t word = rmt.STEP_RMT_CONF(channel);
        if ((word & 1) == 0)
            continue;
        CHECK(!plays[channel] && (RMTMEM[channel][0] >> 15 & 1) != 0);
        plays_until[channel] = now + (RMTMEM[channel][0] & 0x7FFF) * 3; /* 80 MHz */
        plays[channel] = true;
        rmt.STEP_RMT_CONF(channel) = word & ~1u;
    }
}

/* Pulses of channels end at their time, not when someone looks. */
static void advance_to(uint64_t to) {
    for (unsigned channel = 0; channel < CHANNELS; channel++) {
        if (!plays[channel] || plays_until[channel] > to)
            continue;
        now = plays_until[channel];
        plays[channel] = false;
        look_at_pins();
    }
    i2s_model_pass(now, to, 0);
    now = to;
}

static void pass(unsigned cycles) {
    look_at_gpio();
    look_at_rmt();
    look_at_pins();
    advance_to(now + cycles);
}

uint32_t emulated_cycles(void) {
    pass(ACCESS_CYCLES);
    return (uint32_t)now;
}

gpio_dev_t *emulated_gpio(void) {
    pass(ACCESS_CYCLES);
    return &gpio;
}

volatile struct i2s_registers *emulated_i2s(void) {
    pass(ACCESS_CYCLES / 4);
    return i2s_model_registers();
}

void esp_rom_delay_us(uint32_t us) {
    pass(us * CYCLES_PER_US);
}
rmt_dev_t *emulated_rmt(void) {
    pass(ACCESS_CYCLES / 4);
    return &rmt;
}

mcpwm_dev_t *emulated_pwm(void) {
    return &pwm;
}

timg_dev_t *emulated_timer(void) {
    pass(ACCESS_CYCLES);
    return &timer;
}

int64_t esp_timer_get_time(void) {
    return (int64_t)(now / CYCLES_PER_US);
}

/* ---- ESP-IDF ---- */

struct step *step_vector_argument;

static struct handler {
    void (*to)(void *arg);
    void *arg;
} on_pins, on_switches;

esp_err_t esp_intr_alloc(int source, int flags, intr_handler_t to, void *arg, intr_handle_t *handle) {
    (void)flags, (void)handle;
    if (source == ETS_TG0_T1_LEVEL_INTR_SOURCE)
        on_switches = (struct handler){to, arg};
    return ESP_OK;
}

esp_err_t gpio_isr_register(void (*to)(void *arg), void *arg, int flags, gpio_isr_handle_t *handle) {
    (void)flags, (void)handle;
    on_pins = (struct handler){to, arg};
    return ESP_OK;
}

esp_err_t gpio_config(const gpio_config_t *config) {
    for (unsigned pin = 0; pin < PINS; pin++) {
        if ((config->pin_bit_mask >> pin & 1) == 0)
            continue;
        matrix[pin].is_gpio = true;
        matrix[pin].signal = SIG_GPIO_OUT_IDX;
    }
    return ESP_OK;
}
esp_err_t gpio_set_level(gpio_num_t pin, uint32_t level) {
    const uint64_t bit = (uint64_t)1 << pin;
    out = level != 0 ? out | bit : out & ~bit;
    i2s_model_pin((unsigned)pin, level != 0);
    return ESP_OK;
}
esp_err_t gpio_set_intr_type(gpio_num_t pin, gpio_int_type_t type) {
    (void)pin;
    CHECK(type == GPIO_INTR_ANYEDGE);
    return ESP_OK;
}
esp_err_t gpio_intr_enable(gpio_num_t pin) {
    edges_on |= (uint64_t)1 << pin;
    return ESP_OK;
}

esp_err_t rmt_new_tx_channel(const rmt_tx_channel_config_t *config, rmt_channel_handle_t *channel) {
    static unsigned channels;
    rmt.STEP_RMT_CONF(channels % BOARD_AXIS_COUNT) = 1u << 6 | 1u << 19; /* rests low */
    matrix[config->gpio_num].is_gpio = true;
    matrix[config->gpio_num].signal = RMT_SIG_OUT0_IDX + channels % BOARD_AXIS_COUNT;
    *channel = (rmt_channel_handle_t)(uintptr_t)(channels++ % BOARD_AXIS_COUNT + 1);
    return ESP_OK;
}

/* ---- the controller ---- */

static struct machine machine;
static struct hal hal;
static struct pin_map map;
static struct step_engine_board step_pins;
static struct follow follow;
static char said[4096];
static size_t said_count;

static void say(void *ctx, const char *bytes, size_t count) {
    (void)ctx;
    for (size_t i = 0; i < count && said_count < sizeof said - 1; i++)
        said[said_count++] = bytes[i];
    said[said_count] = '\0';
}

static size_t load_driver(const void *ctx, uint8_t key, void *bytes, size_t size) {
    static const struct store_pair driver_of_a = {.number = SETTING_SECOND_MOTOR + AXIS_Y,
                                                  .value = AXIS_A + 1};
    (void)ctx, (void)size;
    return key == STORE_KEY_SETTINGS ? store_pack(bytes, &driver_of_a, 1) : 0;
}

static enum hal_store_state save_nothing(const void *ctx, const struct hal_store_value *values,
                                         size_t count) {
    (void)ctx, (void)values, (void)count;
    return HAL_STORE_DONE;
}

/* Each start is that of a machine in which nothing but the second motor was set. */
static const struct hal_store store = {.load = load_driver, .save = save_nothing};

/* A signal of the second motor. @param y2, a  by the board file, and by a setting */
static struct pin_wire *second_wire(enum board_signal y2, enum board_signal a) {
    return &map.wire[BY_SETTING ? a : y2];
}

static bool calls_low; /* the board calls the lines of the second motor active low */

static void wire_motors(void) {
    for (unsigned n = 0; n < AXIS_COUNT; n++) {
        struct input_wire wire[INPUT_COUNT];
        board_inputs(&map, wire);
        motors[n] = (struct motor){.step = step_pins.step_gpio[n],
                                   .dir = step_pins.dir_gpio[n],
                                   .limit = wire[INPUT_LIMIT_MAX + n].pin,
                                   .closes_at = INT32_MAX};
    }
    motors[SECOND_Y].is_low = motors[SECOND_Y].is_reversed = calls_low;
}

/* As firmware_start_hal() and the motion task. */
static void start(void) {
    static const struct text_out text = {.write = say};
    static const struct input_roles roles = {.door = INPUT_NONE, .hold = INPUT_NONE, .start = INPUT_NONE};
    struct input_wire inputs[INPUT_COUNT];
    struct output_wire outputs[SWITCH_COUNT];
    is_up = false;
    memset(plays, 0, sizeof plays);
    i2s_model_reset(now);
    pins_in = ~(uint64_t)0;
    pin_map_init(&map);
    second_wire(SIGNAL_STEP_Y2, SIGNAL_STEP_A)->active_high = !calls_low;
    second_wire(SIGNAL_DIR_Y2, SIGNAL_DIR_A)->active_high = !calls_low;
    outputs_make_safe(&map);
    board_inputs(&map, inputs);
    board_outputs(&map, outputs);
    memset(&hal, 0, sizeof hal);
    step_pins = board_step_engine(&map);
    wire_motors();
    drive(0, true);
    inputs_init(&hal.inputs, inputs, &step_pins.gang, &roles);
    CHECK(outputs[SWITCH_ENABLE_X + SECOND_Y].pin == second_wire(SIGNAL_ENABLE_Y2, SIGNAL_ENABLE_A)->gpio);
    CHECK(outputs_init(&hal.outputs, outputs, &hal.step.shifted));
    CHECK(step_engine_init(&hal.step, &step_pins));
    struct machine_board board = board_machine(&map);
    board.ganged = chip_ganged(&hal, &step_pins.gang);
    board.store = BY_SETTING ? &store : NULL;
    machine_init(&machine, &board, &hal, &hal.step, &text);
    follow_init(&follow, &machine, &hal);
    CHECK(step_engine_attach(machine_step(&machine)) && inputs_attach(&hal.inputs, &machine));
    step_engine_show(machine_step(&machine));
    pass(100 * CYCLES_PER_US); /* also through the registers */
    is_up = true;
}

/* Cycles at which a timer's alarm is due; ~0: its timer rests. */
static uint64_t alarm_of(unsigned n, unsigned cycles_per_tick) {
    static uint64_t zero[2];
    const uint32_t both = STEP_TIMER_RUN | STEP_TIMER_ALARM;
    if (timer.hw_timer[n].load.val != 0)
        zero[n] = now;
    timer.hw_timer[n].load.val = 0;
    if ((timer.hw_timer[n].config.val & both) != both)
        return UINT64_MAX;
    return zero[n] + (uint64_t)timer.hw_timer[n].alarmlo.val * cycles_per_tick;
}

static void take_edges(void) {
    look_at_gpio();
    while (gpio.status != 0 || gpio.status1.val != 0) {
        on_pins.to(on_pins.arg);
        look_at_gpio();
    }
}

/* Until the registers show what was written, if no step comes before. */
static void show_words(void) {
    const uint64_t shown = now + 5 * I2S_FRAME_CYCLES, next = alarm_of(0, CYCLES_PER_TICK);
    if (BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S && next > shown)
        advance_to(shown);
}

/* The next interrupt of a timer, when it comes before `end`. @return false: none does */
static bool interrupt_before(uint64_t end) {
    const uint64_t step_at = alarm_of(0, CYCLES_PER_TICK), switch_at = alarm_of(1, CYCLES_PER_US);
    const unsigned first = step_at <= switch_at ? 0 : 1;
    const uint64_t at = first == 0 ? step_at : switch_at;
    if (at > end && at > now)
        return false;
    advance_to(at > now ? at : now);
    timer.hw_timer[first].config.val &= ~STEP_TIMER_ALARM;
    if (first == 0)
        step_interrupt(step_vector_argument);
    else
        on_switches.to(on_switches.arg);
    pass(ACCESS_CYCLES);
    show_words();
    take_edges();
    return true;
}

static void run_us(uint32_t us) {
    const uint64_t end = now + (uint64_t)us * CYCLES_PER_US;
    while (now < end) {
        const uint64_t round = now + 1000 * CYCLES_PER_US < end ? now + 1000 * CYCLES_PER_US : end;
        take_edges();
        inputs_sample(&hal.inputs);
        (void)machine_poll(&machine);
        step_engine_show(machine_step(&machine));
        follow_poll(&follow);
        while (interrupt_before(round)) {
        }
        advance_to(now > round ? now : round);
    }
}

static void type(const char *line) {
    said_count = 0;
    said[0] = '\0';
    CHECK(rx_put_all(machine_rx(&machine), (const uint8_t *)line, strlen(line)) == strlen(line));
}

/* What is answered, until the machine is at rest. */
static const char *send(const char *line) {
    type(line);
    for (int round = 0; round < 4000 && (strstr(said, "ok\r\n") == NULL && strstr(said, "error:") == NULL);
         round++)
        run_us(10000);
    for (int round = 0; round < 4000 && !machine_is_at_rest(&machine); round++)
        run_us(10000);
    run_us(10000);
    return said;
}

static void set_up(void) {
    static const char *const lines[] = {"$22=1\n",     "$44=2\n",    "$45=0\n",    "$24=100\n",
                                        "$25=2000\n",  "$26=25\n",   "$27=2\n",    "$101=250\n",
                                        "$111=5000\n", "$121=500\n", "$131=100\n", "$X\n"};
    start();
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        CHECK(strstr(send(lines[i]), "ok\r\n") != NULL);
}

/* ---- tests ---- */

enum { HIGH_STEPS = 1007, PULL_OFF = 500 };

static void crooked(int32_t at, int32_t skew) {
    motors[FIRST_Y].closes_at = motors[SECOND_Y].closes_at = HIGH_STEPS;
    place(FIRST_Y, at);
    place(SECOND_Y, at + skew);
    take_edges();
    run_us(20000);
}

static void check_stands(int32_t first, int32_t second, int line) {
    if (motors[FIRST_Y].at == first && motors[SECOND_Y].at == second)
        return;
    printf("line %d: %d %d, not %d %d: %s\n", line, motors[FIRST_Y].at, motors[SECOND_Y].at, first, second,
           said);
    failures++;
}
#define STANDS(first, second) check_stands(first, second, __LINE__)

static void home_square(int32_t skew) {
    set_up();
    crooked(-3000, skew);
    CHECK(strcmp(send("$HY\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - PULL_OFF);
}

static void both_motors_end_a_pull_off_before_their_switches(void) {
    static const int32_t skews[] = {0, 1, -1, 37, -250, 1000, -1200};
    for (size_t i = 0; i < sizeof skews / sizeof skews[0]; i++) {
        home_square(skews[i]);
        CHECK(strcmp(send("G91G0Y-3\n"), "ok\r\n") == 0);
        STANDS(HIGH_STEPS - PULL_OFF - 750, HIGH_STEPS - PULL_OFF - 750);
    }
}

static void a_second_motor_that_is_mounted_the_other_way_round(void) {
    set_up();
    motors[SECOND_Y].is_reversed = true;
    CHECK(strcmp(send("$8=2\n"), "ok\r\n") == 0);
    crooked(-3000, 300);
    CHECK(strcmp(send("$HY\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - PULL_OFF);
    /* $2 and $3 turn both, also after a hold. */
    motors[FIRST_Y].is_reversed = !motors[FIRST_Y].is_reversed;
    motors[SECOND_Y].is_reversed = !motors[SECOND_Y].is_reversed;
    CHECK(strcmp(send("$3=2\n"), "ok\r\n") == 0);
    CHECK(strcmp(send("G91G0Y-1\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF - 250, HIGH_STEPS - PULL_OFF - 250);
}

/* The same as `active = "low"` in the board file, for the pins of the second motor. */
static void lines_that_the_board_calls_active_low(void) {
    calls_low = true;
    home_square(300);
    CHECK(strcmp(send("$2=2\n"), "ok\r\n") == 0);
    motors[FIRST_Y].is_low = true;
    motors[SECOND_Y].is_low = motors[FIRST_Y].high = motors[SECOND_Y].high = false;
    crooked(HIGH_STEPS - PULL_OFF, 0); /* the edge that $2 has made is not a step */
    CHECK(strcmp(send("G91G0Y-1\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF - 250, HIGH_STEPS - PULL_OFF - 250);
    calls_low = false;
}

static void each_motor_has_its_own_pull_off(void) {
    set_up();
    CHECK(strcmp(send("$201=3\n"), "ok\r\n") == 0);
    crooked(-2000, -90);
    CHECK(strcmp(send("$HY\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - 750);
}

/* Only the first one's counts, and the difference of the pull-offs is made once. */
static void both_motors_stop_at_one_switch(void) {
    set_up();
    CHECK(strcmp(send("$206=2\n"), "ok\r\n") == 0);
    CHECK(strcmp(send("$201=3\n"), "ok\r\n") == 0);
    for (int homing = 0; homing < 2; homing++) {
        if (homing == 0)
            crooked(-2000, 90);
        CHECK(strcmp(send("$HY\n"), "ok\r\n") == 0);
        STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - 750 + 90);
    }
    CHECK(strcmp(send("G91G0Y-1\n"), "ok\r\n") == 0);
    STANDS(HIGH_STEPS - PULL_OFF - 250, HIGH_STEPS - 1000 + 90);
}

static void more_than_squaring_allows_is_alarm_10(void) {
    for (int32_t skew = -1800; skew <= 1800; skew += 3600) {
        set_up();
        crooked(-4000, skew);
        CHECK(strstr(send("$HY\n"), "ALARM:10\r\n") != NULL);
        int32_t alone = abs(motors[FIRST_Y].at - motors[SECOND_Y].at);
        CHECK(alone >= 1800 - 5 * 250 - 1 && alone <= 1800 - 5 * 250 + 1); /* 5 % of the travel, no further */
        const int32_t first = motors[FIRST_Y].at, second = motors[SECOND_Y].at;
        CHECK(strstr(send("$X\n"), "ok\r\n") != NULL);
        CHECK(strstr(send("G91G0Y-1\n"), "ok\r\n") != NULL);
        STANDS(first - 250, second - 250); /* no one waits any more */
    }
}

static void a_reset_or_an_estop_at_any_moment_leaves_both_motors_stepping(void) {
    for (uint32_t ms = 100; ms < 3600; ms += 250) {
        const bool estop = ms / 250 % 2 == 0;
        set_up();
        crooked(-2500, -700);
        type("$HY\n");
        run_us(ms * 1000 + ms);
        if (estop)
            drive(map.wire[SIGNAL_ESTOP].gpio, false);
        else
            type("\x18");
        take_edges();
        run_us(100000);
        drive(map.wire[SIGNAL_ESTOP].gpio, true);
        run_us(100000);
        type("\x18");
        run_us(2000000); /* the banner */
        CHECK(strstr(send("$X\n"), "ok\r\n") != NULL);
        const int32_t first = motors[FIRST_Y].at, second = motors[SECOND_Y].at;
        CHECK(strstr(send("G91G0Y-1\n"), "ok\r\n") != NULL);
        STANDS(first - 250, second - 250);
        CHECK(strstr(send("$HY\n"), "ok\r\n") != NULL);
        STANDS(HIGH_STEPS - PULL_OFF, HIGH_STEPS - PULL_OFF);
    }
}

/* One event of Y; the other core holds motors as soon as its pulse has begun. */
static void step_and_hold(axis_mask_t first, axis_mask_t second) {
    hal_step_set(&hal.step, 1u << AXIS_Y);
    pass(ACCESS_CYCLES);
    hal.ganged.hold(&hal, first, second);
    hal_step_clear(&hal.step);
    pass(1000 * CYCLES_PER_US);
    CHECK(!motors[FIRST_Y].high && !motors[SECOND_Y].high);
}

static void a_motor_that_begins_to_wait_makes_its_last_pulse(void) {
    set_up();
    crooked(-1000, 0);
    step_and_hold(1u << AXIS_Y, 0);
    STANDS(-999, -999);
    step_and_hold(0, 1u << AXIS_Y);
    STANDS(-999, -998);
    step_and_hold(0, 0);
    STANDS(-998, -998);
}

static void the_second_switch_is_a_hard_limit(void) {
    set_up();
    CHECK(strcmp(send("$21=1\n"), "ok\r\n") == 0);
    crooked(0, 200);
    CHECK(strstr(send("G91G1Y20F3000\n"), "ALARM:1\r\n") != NULL);
    STANDS(HIGH_STEPS - 200, HIGH_STEPS);
}

/* ---- e-stop ---- */

enum { CUT_CYCLES = 10 * CYCLES_PER_US }; /* through registers: the words that wait, and one more */

static bool shows_off(enum switch_output output) {
    const struct output_wire *wire = &hal.outputs.wire[output];
    return wire->pin == NO_PIN || is_high(wire->pin, out) != wire->active_high;
}

static bool has(enum switch_output output) {
    return hal.outputs.wire[output].pin != NO_PIN;
}

static bool drivers_are(bool on) {
    bool all = true;
    for (unsigned n = SWITCH_ENABLE; n <= SWITCH_ENABLE_LAST; n++)
        all &= !has((enum switch_output)n) || shows_off((enum switch_output)n) != on;
    return all;
}

static bool all_is_cut(void) {
    return drivers_are(false) && shows_off(SWITCH_SPINDLE_ENABLE) && pwm.operators[0].timestamp[0].val == 0;
}

/* A spindle that turns, Y that moves, and motors that would stay on ($1=255). */
static void work(void) {
    set_up();
    crooked(-2000, 0);
    CHECK(strstr(send("$1=255\n"), "ok\r\n") != NULL && strstr(send("M3S500\n"), "ok\r\n") != NULL);
    type("G91G1Y8F3000\n");
    run_us(300000);
    CHECK(drivers_are(true) && (!has(SWITCH_SPINDLE_ENABLE) || !shows_off(SWITCH_SPINDLE_ENABLE)));
    CHECK(!has(SWITCH_SPINDLE_PWM) || pwm.operators[0].timestamp[0].val != 0);
}

static void an_estop_cuts_drivers_and_spindle_before_any_task(void) {
    work();
    const uint64_t edge = now;
    drive(map.wire[SIGNAL_ESTOP].gpio, false);
    take_edges();
    CHECK(BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S || all_is_cut());
    while (!all_is_cut() && now < edge + CUT_CYCLES)
        pass(ACCESS_CYCLES);
    CHECK(all_is_cut());
    for (unsigned ms = 0; ms < 200; ms++) { /* and they stay off until a reset behind its release */
        run_us(1000);
        CHECK(all_is_cut());
    }
    CHECK(strstr(said, "ALARM:50\r\n") != NULL);
    type("\x18");
    run_us(200000);
    CHECK(all_is_cut());
    drive(map.wire[SIGNAL_ESTOP].gpio, true);
    run_us(100000);
    CHECK(all_is_cut());
    type("\x18");
    run_us(1000000);
    CHECK(drivers_are(true) && shows_off(SWITCH_SPINDLE_ENABLE));
}

/* A hard limit keeps the position: the motors hold. */
static void a_limit_cuts_no_driver(void) {
    work();
    CHECK(strstr(send("$21=1\n"), "ok\r\n") != NULL);
    drive(motors[FIRST_Y].limit, false);
    take_edges();
    pass(CUT_CYCLES);
    CHECK(drivers_are(true));
    run_us(100000);
    CHECK(strstr(said, "ALARM:1\r\n") != NULL && drivers_are(true));
}

/* The interrupt's word finds no room: the motion task's next round repeats it. */
static void a_full_fifo_loses_no_cut(void) {
    work();
    for (unsigned n = 0; BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S && n < 2 * I2S_FIFO_WORDS; n++)
        i2s_model_registers()->fifo_wr = hal.step.shifted | hal.step.i2s_lines;
    drive(map.wire[SIGNAL_ESTOP].gpio, false);
    take_edges();
    run_us(2000);
    CHECK(all_is_cut());
}

int main(void) {
    for (unsigned pin = 0; pin < PINS; pin++) {
        matrix[pin].is_gpio = pin < FIRST_JTAG || pin > FIRST_JTAG + 3;
        matrix[pin].signal = SIG_GPIO_OUT_IDX;
    }
    both_motors_end_a_pull_off_before_their_switches();
    a_second_motor_that_is_mounted_the_other_way_round();
    lines_that_the_board_calls_active_low();
    each_motor_has_its_own_pull_off();
    both_motors_stop_at_one_switch();
    more_than_squaring_allows_is_alarm_10();
    a_reset_or_an_estop_at_any_moment_leaves_both_motors_stepping();
    a_motor_that_begins_to_wait_makes_its_last_pulse();
    the_second_switch_is_a_hard_limit();
    an_estop_cuts_drivers_and_spindle_before_any_task();
    a_limit_cuts_no_driver();
    a_full_fifo_loses_no_cut();
    return report();
}
