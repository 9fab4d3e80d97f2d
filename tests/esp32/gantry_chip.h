/* SPDX-License-Identifier: MIT
 * An emulated ESP32 with a gantry at its pins: motors and switches, the GPIO matrix, the registers that the
 * firmware uses, and the controller on it in virtual time. For gantry.c. */
#ifndef WIFICNC_TESTS_ESP32_GANTRY_CHIP_H
#define WIFICNC_TESTS_ESP32_GANTRY_CHIP_H

#include "app/board.h"
#include "app/follow.h"
#include "check.h"
#include "chip_ganged.h"
#include "hal/chip_hal.h"
#include "hal/i2s_registers.h"
#include "hal/rmt_registers.h"
#include "hal/spi_registers.h"
#include "hal/step_shift.h"
#include "hal/step_vector.h"
#include "input/rx.h"
#include "io/switch_timer.h"
#include "machine/parts.h"
#include "settings/store.h"
#include "shift_model.h"

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

static const bool by_shift =
    BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_I2S || BOARD_STEP_ENGINE == BOARD_STEP_ENGINE_SPI;

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
    return step_shift_has(pin) ? (shift_model_shown() >> (pin - BOARD_I2SO_FIRST) & 1) != 0
                               : (levels >> pin & 1) != 0;
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
    shift_model_connect(pin, signal, now);
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
    shift_model_pass(now, to, 0);
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
    return shift_model_i2s();
}

volatile struct spi_registers *emulated_spi(void) {
    pass(ACCESS_CYCLES / 4);
    return shift_model_spi();
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
    shift_model_pin((unsigned)pin, level != 0);
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
    shift_model_reset(now);
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
    drive(map.wire[SIGNAL_ESTOP].gpio, false); /* its contact is closed */
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
    if (by_shift && next > shown)
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

#endif
