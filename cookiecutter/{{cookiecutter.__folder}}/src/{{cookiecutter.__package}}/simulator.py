{% if cookiecutter.__paced %}
{{ paced_simulator(cookiecutter.name) -}}
{% elif cookiecutter.what == "simulator" %}
{{ plain("my_simulator.py", "my_simulator", cookiecutter.name) -}}
{% endif %}
