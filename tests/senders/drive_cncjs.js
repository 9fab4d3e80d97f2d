// Drives a CNCjs server as its own pages do: signs in, opens the serial port, reads settings and parser state,
// loads a program and streams it to its end. Prints what CNCjs saw as JSON. Without a file: what it shows when a locked
// controller refuses a line.
'use strict';
const [directory, url, port, file] = process.argv.slice(2);
const { createRequire } = require('module');
const io = createRequire(directory + '/node_modules/cncjs/package.json')('socket.io-client');
const fs = require('fs');

const deadline = setTimeout(() => fail('nothing more happened'), 300000);
const errors = [];
const shown = [];
let controller = {};
let settings = {};
let hasRun = false; // a report is as old as the last poll: Idle counts once Run was seen

function fail(why) {
    console.error(why, JSON.stringify({ controller, errors }));
    process.exit(1);
}

async function main() {
    const answer = await fetch(url + '/api/signin', {
        method: 'POST', headers: { 'Content-Type': 'application/json' }, body: '{"token":""}',
    });
    const { token } = await answer.json();
    const socket = io.connect(url, { query: 'token=' + token, transports: ['websocket'] });
    const command = (...words) => socket.emit('command', port, ...words);
    let loaded = false;
    let started = false;
    socket.on('serialport:error', (options) => fail('the port: ' + JSON.stringify(options)));
    socket.on('serialport:read', (line) => {
        if (/^(error|ALARM):/.test(line)) errors.push(line);
        shown.push(line);
        if (!file && /Locked: log in/.test(line)) begin();
    });
    socket.on('workflow:state', (state) => {
        if (!file && state === 'paused') console.log(JSON.stringify(shown)), process.exit(0);
    });
    socket.on('controller:settings', (type, all) => { settings = all.settings || {}; begin(); });
    socket.on('controller:state', (type, state) => {
        controller = state;
        hasRun = hasRun || (started && state.status.activeState === 'Run');
        begin();
    });
    socket.on('sender:status', (status) => {
        if (status.name && !started) {
            started = true;
            command('gcode:start');
        }
        if (status.finishTime > 0 && status.received === status.total) finish(status);
    });
    socket.on('startup', () => socket.emit('open', port, { controllerType: 'Grbl', baudrate: 115200, rtscts: false }));

    function begin() {
        if (loaded || (file && (!settings.$100 || !(controller.parserstate || {}).modal))) return;
        loaded = true;
        command('gcode:load', 'job.nc', file ? fs.readFileSync(file, 'utf8') : 'G1 X1 F600\nG1 X2\n', {}, () => {});
    }

    function finish(status) {
        const timer = setInterval(() => {
            if (!hasRun || controller.status.activeState !== 'Idle') return;
            clearInterval(timer);
            clearTimeout(deadline);
            const { x, y, z } = controller.status.mpos;
            console.log(JSON.stringify({
                position: [x, y, z].map(Number), steps_per_mm: Number(settings.$100), errors,
                lines: [status.total, status.sent, status.received], modal: controller.parserstate.modal,
            }));
            socket.emit('close', port);
            setTimeout(() => process.exit(0), 200);
        }, 100);
    }
}

main().catch((error) => fail(error.stack));
