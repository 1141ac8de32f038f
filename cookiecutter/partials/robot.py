{% if cookiecutter.example == "file" %}
{{ partial("robot_file.py") -}}
{% elif cookiecutter.example == "wheeled" %}
{{ plain("my_rover.py", "my_rover", cookiecutter.name) -}}
{% else %}
{{ plain("my_arm.py", "my_arm", cookiecutter.name) -}}
{% endif %}
